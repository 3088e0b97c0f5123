"""Published experiments, run again: one package for each paper, named after its key.

Each has ``run(trials, folder)``, which returns rows (`rows`) and writes its figures into `folder` unless that is None,
a ``LEGEND`` that says what the words in its rows mean, and ``FIGURES``: which rows belong to which figure. They are
`makarem2014`, `makarem2016`, `sabater2018` and `sayres2021`; `gallery` is one page of their figures and numbers.
"""
