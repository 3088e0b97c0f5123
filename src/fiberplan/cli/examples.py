"""Examples in the help of every command: a line to type, and what it is for."""

EXAMPLES: dict[str, tuple[tuple[str, str], ...]] = {
    "demo": (
        ("fiberplan demo -o demo", "open demo/plan.html to see it move"),
        ("fiberplan demo --seed 3 -o demo", "two other fields"),
    ),
    "allocate": (
        ("fiberplan allocate sdss all.ecsv -o targets.ecsv", "who takes what"),
        ("fiberplan allocate sdss all.ecsv --start plan.fits --plan next.fits", "and the motion"),
        ("fiberplan allocate desi all.csv --require sky=40 --regions 10", "4 sky in each tenth"),
    ),
    "survey": (
        ("fiberplan survey sdss --demo 4 -o out", "a made-up sky: out/report.html"),
        ("fiberplan survey sdss all.ecsv fields.ecsv -o out", "one's own"),
        ("fiberplan survey desi --demo 9 --solver heuristic -o out", "quicker"),
    ),
    "plan": (
        ("fiberplan plan sdss field.ecsv --margin 0.8 -o plan.fits", "from folded"),
        ("fiberplan plan sdss next.ecsv --start plan.fits -o next.fits", "from the end of a plan"),
        ("fiberplan plan sdss next.ecsv --start seen.csv --offline R0C1,R0C2", "from what was seen"),
        ("fiberplan plan sdss field.ecsv --conflicts drop --page plan.html", "as far as goals allow"),
        ("fiberplan plan sdss field.ecsv --for moons -o plan.fits", "so that its motors can do it"),
        ("fiberplan plan sdss field.ecsv --planner greedy-fold --set step=1", "another planner"),
    ),
    "verify": (
        ("fiberplan verify plan.fits", "at the margin of the plan"),
        ("fiberplan verify plan.fits --margin 0.5 --jitter 0.1", "clocks may be off by 0.1 s"),
        ("fiberplan verify plan.fits --instrument sdss", "on another description of the array"),
    ),
    "replay": (
        ("fiberplan replay plan.fits", "does every claim in the file hold?"),
        ("fiberplan replay new.fits --since plan.fits", "after amend: only what changed"),
    ),
    "diagnose": (
        ("fiberplan diagnose plan.fits", "why who did not arrive, and what took the time"),
        ("fiberplan diagnose plan.fits --prove", "and what is proven of the time that pairs need"),
        ("fiberplan diagnose plan.fits --json", "the same for programs"),
    ),
    "show": (
        ("fiberplan show plan.fits -o plan.html", "open plan.html in a browser"),
        ("fiberplan show a.fits b.fits -o both.html", "two plans side by side"),
    ),
    "figure": (
        ("fiberplan figure plan.fits clearance -o near.pdf", "how near arms come"),
        ("fiberplan figure plan.fits joint-space --positioner R0C1 -o q.svg", "what blocks one"),
        ("fiberplan figure plan.fits snapshots --time 0 --time 3.5 -o row.png", "two moments"),
    ),
    "animate": (
        ("fiberplan animate plan.fits -o plan.mp4", "about 10 s of film"),
        ("fiberplan animate plan.fits --speed 4 --fps 20 --size 600 -o plan.gif", "small enough for a page"),
    ),
    "export": (
        ("fiberplan export plan.fits --to ecsv -o knots.ecsv", "angles over time"),
        ("fiberplan export plan.fits --to motions -o moves.ecsv", "a list of moves"),
        ("fiberplan export plan.fits --to sdss -o traj.json --delay 1", "for controllers, proven"),
        ("fiberplan export plan.fits --to moons -o wave.json --latency 0.03", "likewise"),
    ),
    "audit": (
        ("fiberplan audit sdss night/*.json --margin 0.8 -o night.html", "a night of trajectories"),
        ("fiberplan audit fp-20260219.ecsv moves.csv --state fp-20260219.ecsv", "DESI's move tables"),
    ),
    "simulate": (
        ("fiberplan simulate sdss traj.json --abort 10 -o state.ecsv", "where an abort leaves all"),
        ("fiberplan simulate sdss traj.json --latency 0.05 --runs 1000", "late starts, a thousand times"),
        ("fiberplan simulate sdss traj.json --any-stall 1 --runs 1000", "which stall is dangerous?"),
    ),
    "amend": (
        ("fiberplan amend plan.fits R0C1 -12.5 3.25 -o new.fits", "another target, in mm"),
        ("fiberplan amend plan.fits R0C1 --angles 90 120 -o new.fits", "the same in degrees"),
        ("fiberplan amend plan.fits --goals goals.ecsv -o new.fits", "several"),
    ),
    "separate": (("fiberplan separate sdss --start seen.csv -o apart.fits", "part arms that touch"),),
    "fold": (("fiberplan fold sdss --start plan.fits -o home.fits", "from the end of a plan"),),
    "unwind": (("fiberplan unwind sdss --start motion.ecsv --start-time 3.5 -o home.fits", "from half a motion"),),
    "instruments": (
        ("fiberplan instruments", "what is built in"),
        ("fiberplan instruments sdss", "its numbers and where they come from"),
    ),
    "planners": (
        ("fiberplan planners", "which there are"),
        ("fiberplan planners greedy-fold", "what can be set of it"),
    ),
    "reproduce": (
        ("fiberplan reproduce", "which papers"),
        ("fiberplan reproduce makarem2014 --trials 5 -o figures", "figures of one, from few trials"),
        ("fiberplan reproduce --all -o figures", "all; open figures/index.html"),
    ),
    "warmup": (("fiberplan warmup", "once, after installing"),),
    "": (
        ("fiberplan demo -o demo", "a first plan, without any file"),
        ("fiberplan plan sdss field.ecsv --margin 0.8 -o plan.fits", "plan and prove"),
        ("fiberplan COMMAND --help", "examples of each command"),
    ),
}


def examples_of(command: str) -> str:
    """What stands below the help of a command; "" is the help of all."""
    wide = max(len(line) for line, _ in EXAMPLES[command])
    return "\n".join(("Examples:", *(f"{line:<{wide}}  # {what}" for line, what in EXAMPLES[command])))
