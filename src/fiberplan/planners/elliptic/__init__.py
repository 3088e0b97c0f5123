"""The field of Makarem2016, in which arms are elongated zones at several heights.

`zones` makes ellipses of bodies, `field` is the potential, `descent` the compiled loop over it, and `relief` a way out
of deadlock in the spirit of Tao2018. What is shared with the field of Makarem2014 is in
`fiberplan.planners.navigation`.
"""
