"""Files nobody vouches for, by the million: seeds, mutations of them, what reads them, and worker processes."""
