"""Published experiments, run again: a module or package a paper, named after its key.

Each has ``run(trials, folder)``, which returns rows (see `fiberplan.reproductions.rows`) and writes its figures into
`folder` unless that is None, and a ``LEGEND`` that says what the words in its rows mean.
"""
