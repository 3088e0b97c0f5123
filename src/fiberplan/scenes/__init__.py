"""Made-up fields, each the same for the same seed: uniform, clustered, or with targets assigned to probe arms."""
