"""Samples on disk: planned, made by workers, written as shards, read back, verified."""
