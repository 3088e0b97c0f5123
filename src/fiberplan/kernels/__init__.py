"""Compiled geometry: segments, arms, clearance, sweeps, neighbours. Numbers and arrays only."""
