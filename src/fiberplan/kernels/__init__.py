"""Compiled geometry: numbers and arrays only, no Python objects, no memory taken in a step.

- `kernel_cache`: compiled kernels on disk, under names that hold everything they were made from
- `compile`: the one compile policy (`kernel`, `leaf`, `inlined`)
- `arms`: what kernels know of a focal plane, link frames, and bounds on how far a body point moves
- `four_bar`: the third link of a four-bar arm, and its zone of avoidance
- `segments`: distances between points and segments
- `convex`: how far two convex pieces are apart, and along which axis
- `clearance`: clearance of two arms, bodies and all
- `depth`: clearance with a sign: how far arms that overlap would have to be moved apart
- `slopes`: how signed clearances change as joints turn
- `sweep`: whether a pair is clear over a whole step (first order)
- `boxes`: whether a pair is clear wherever in boxes of joint space it is
- `box_bounds`: bounds of a clearance over boxes of joint space, and which joint matters most
- `even_motion`: a lower bound of clearance over an interval of even motion (second order)
- `neighbours`: neighbour lists in O(n)
- `randoms`: random numbers that are the same on every platform
"""
