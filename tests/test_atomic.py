"""Files appear whole, keep what they were, and never take the place of what is no file."""

import gc
import os
import signal
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import fiberplan
from fiberplan.errors import PlanError
from fiberplan.tables.atomic import write_whole
from fiberplan.tables.uncollected import uncollected

pytestmark = pytest.mark.small

SOURCE = Path(fiberplan.__file__).parents[1]


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_threads_that_write_one_path_never_show_half_of_it(tmp_path):
    path = tmp_path / "plan.fits"
    contents = [bytes([k]) * (1 << 20) for k in range(4)]
    write_whole(path, contents[0])
    failed, done = [], threading.Event()

    def write(content):
        try:
            for _ in range(30):
                write_whole(path, content)
        except PlanError as error:
            failed.append(error)

    def read():
        while not done.is_set():
            if path.read_bytes() not in contents:
                failed.append("half")

    reader = threading.Thread(target=read)
    writers = [threading.Thread(target=write, args=(content,)) for content in contents]
    for thread in (reader, *writers):
        thread.start()
    for thread in writers:
        thread.join()
    done.set()
    reader.join()
    assert not failed
    assert [p.name for p in tmp_path.iterdir()] == ["plan.fits"]


def test_a_planted_link_is_not_followed(tmp_path, monkeypatch):
    monkeypatch.setattr("secrets.token_hex", lambda _: "known")
    write_whole(tmp_path / "first", b"1")
    victim = tmp_path / "victim"
    victim.write_bytes(b"precious")
    (tmp_path / ".fiberplan.known.part").symlink_to(victim)
    with pytest.raises(PlanError, match="file exists"):
        write_whole(tmp_path / "plan.fits", b"plan")
    assert victim.read_bytes() == b"precious"


def test_mode_is_kept_and_new_files_follow_the_umask(tmp_path):
    path = tmp_path / "plan.fits"
    before = os.umask(0o027)
    try:
        write_whole(path, b"1")
        assert mode(path) == 0o640
        for kept in (0o600, 0o664):
            path.chmod(kept)
            write_whole(path, b"2")
            assert mode(path) == kept
    finally:
        os.umask(before)


def test_links_stay_links(tmp_path):
    (tmp_path / "night").mkdir()
    link, target = tmp_path / "latest.fits", tmp_path / "night" / "plan.fits"
    link.symlink_to("night/plan.fits")
    for content in (b"first", b"second"):  # the first makes what the link names
        write_whole(link, content)
        assert link.is_symlink()
        assert target.read_bytes() == content


def test_a_loop_of_links_is_one_line(tmp_path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(PlanError, match=r"a: cannot be written \(too many levels of symbolic links\)"):
        write_whole(tmp_path / "a", b"")


def test_devices_and_pipes_are_written_to(tmp_path):
    link = tmp_path / "null"
    link.symlink_to("/dev/null")
    write_whole(link, b"gone")
    assert stat.S_ISCHR(link.stat().st_mode)

    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    got = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    write_whole(pipe, b"through")
    reader.join()
    assert got == [b"through"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["null", "pipe"]


def test_stdout_is_written_to_where_it_stands(tmp_path):
    """By a link of our own, as /dev/stdout is one: a mistake here must not cost the machine's."""
    stdout = tmp_path / "stdout"
    stdout.symlink_to("/proc/self/fd/1")
    code = (
        "from fiberplan.tables.atomic import write_whole\n"
        "print('before')\nwrite_whole('/dev/stdout', b'content\\n')\nprint('after')"
    )
    environment = {**os.environ, "PYTHONPATH": str(SOURCE)}
    with (tmp_path / "out").open("wb") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True, env=environment)
    assert (tmp_path / "out").read_text() == "before\ncontent\nafter\n"
    piped = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert piped.stdout == "before\ncontent\nafter\n"


def test_names_as_long_as_names_may_be(tmp_path):
    path = tmp_path / ("x" * 250 + ".fits")
    write_whole(path, b"plan")
    assert path.read_bytes() == b"plan"
    with pytest.raises(PlanError, match="too long"):
        write_whole(tmp_path / ("x" * 300), b"")
    with pytest.raises(PlanError, match="null byte"):
        write_whole("a\0b", b"")


def test_terminated_while_writing_leaves_nothing(tmp_path):
    """The command is stopped in the middle of its write, when the part file is there."""
    code = (
        "import os, time\nfrom pathlib import Path\n"
        "from fiberplan.cli import main\nfrom fiberplan.cli.app import app\n"
        "from fiberplan.tables.atomic import write_whole\n"
        "def slow(*_):\n    print('writing', flush=True)\n    time.sleep(60)\n"
        "Path.replace = slow\n"
        "@app.command()\ndef write():\n    write_whole('plan.fits', b'plan')\n"
        "import sys; sys.argv = ['fiberplan', 'write']\nmain()"
    )
    environment = {**os.environ, "PYTHONPATH": str(SOURCE)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, env=environment, **pipes)
    assert process.stdout.readline() == b"writing\n"
    assert len(list(tmp_path.iterdir())) == 1
    time.sleep(0.1)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 143
    assert err == b"fiberplan: error: terminated\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("on", [True, False])
def test_garbage_is_collected_again_as_before(on):
    """After an error, too, and where one rest is within another."""

    @uncollected()
    def failing():
        with uncollected():
            assert not gc.isenabled()
        assert not gc.isenabled()
        raise PlanError("no")

    try:
        (gc.enable if on else gc.disable)()
        with pytest.raises(PlanError):
            failing()
        assert gc.isenabled() == on
    finally:
        gc.enable()
