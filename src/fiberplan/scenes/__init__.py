"""Made-up fields, each the same for the same seed.

- `uniform`: configurations spread evenly over the patrol zones, as the papers test planners with
- `clustered`: targets clustered as galaxies are
- `assigned`: targets for probe arms, each with its arm
"""
