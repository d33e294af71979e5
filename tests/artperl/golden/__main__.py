"""Write the golden files anew."""

import os
import sys
from pathlib import Path

from artperl.methods.estimator_files import load_estimator
from tests.artperl import golden

if "--clouds" in sys.argv[1:]:
    golden.write_clouds()
clouds = [*golden.stored(), *golden.real(Path(os.environ["ARTSIM_PARTNET_DIR"]))]
golden.write({one.name: golden.summary(load_estimator(one.estimator)(one.points)) for one in clouds})
print(f"wrote {len(clouds)} estimates")
