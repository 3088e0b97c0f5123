"""What several planners use: none of it decides anything about a plan as a whole."""
