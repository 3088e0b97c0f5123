"""What the planners that follow a potential field share; each kernel is one step of Makarem2014, Table 1.

A field asks every positioner for a step, all from the same positions (simultaneous update): `repulsion` and `singular`
are its ingredients and `speed` its limit. `safe_steps` grants of that what is proven to keep the margin at every
moment of the step, and `recording` keeps the granted motion in few knots. `parity` chooses the elbow solution before
anything moves.
"""
