"""Files nobody vouches for: seeds, what mutates them, and what reads them; ``python -m benchmarks.fuzz`` runs it."""
