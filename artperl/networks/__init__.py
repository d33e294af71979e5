"""Networks of artperl, in plain torch."""
