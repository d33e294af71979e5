"""From a cloud to an estimate: each method is one page."""
