"""Tests of artperl.training."""
