"""Made-up fields, each the same for the same seed.

- `uniform`: configurations spread evenly over the patrol zones, as the papers test planners with
- `decisive`: the smallest scenes in which something has to give way
- `clustered`: targets clustered as galaxies are
- `assigned`: targets for probe arms, each with its arm
"""
