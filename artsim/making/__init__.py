"""Solids and assemblies that procedural objects are made of."""
