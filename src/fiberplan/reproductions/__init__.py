"""Published experiments, run again: one package for each paper, named after its key.

Each has ``run(trials, folder)``, which returns rows (`rows`) and writes its figures into `folder` unless that is None,
and a ``LEGEND`` that says what the words in its rows mean: `makarem2014`, `makarem2016`, `sabater2018`, `sayres2021`.
"""
