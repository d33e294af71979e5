"""Tests of artperl.data."""
