# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C at random times of everything that takes long: it never ends the interpreter, whatever is alive, and what is
done afterwards is right. Without arguments, a test of few processes; with their number, of that many."""
import os
import signal
import subprocess
import sys
import unittest

from common import ROOM, PackageTest

SEED = 1

# Loads a scene, renders auxiliary images and samples, denoises, combines; scenes, results and a thread that renders on
# its own stay alive. Ctrl-C comes at a random moment of each repetition, at the latest in the sleep that ends it.
WORK = """
import covary, numpy, os, random, signal, sys, threading, time
path, denoiser, seed, times = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
chance = random.Random(seed)
samples = numpy.random.default_rng(0).gamma(2, 0.5, (2, 12, 60, 90, 3)).astype("float32")
kept = []

def work():
    scene = covary.Scene.load(path, resolution=(90, 60))
    kept.append(scene)
    result = covary.render(scene, 12, denoise="auto", oidn=denoiser, aovs=True)
    kept.append(result)
    combined = covary.combine(samples[0], samples[1], denoise="auto", oidn=denoiser, force=True)
    return result.image.tobytes() + combined.image.tobytes()

ends = threading.Event()
def render_beside():
    scene = covary.Scene.load(path, resolution=(16, 8))
    while not ends.is_set():
        covary.render(scene, 8, denoise="none")

beside = threading.Thread(target=render_beside)
beside.start()
begin = time.monotonic()
expected = work()
seconds = time.monotonic() - begin
interrupted = 0
for _ in range(times):
    later = threading.Timer(seconds * chance.random(), os.kill, (os.getpid(), signal.SIGINT))
    try:
        later.start()
        work()
        later.join()
        time.sleep(0.2)
    except KeyboardInterrupt:
        interrupted += 1
assert interrupted > 0
ends.set()
beside.join()
assert work() == expected, "other bits"
print("as before")
"""


class CtrlC(PackageTest):
    processes = 8

    def test_the_interpreter_goes_on(self):
        """Eight processes of three interruptions each."""
        denoiser = os.environ["STAND_IN_DENOISER"]
        for seed in range(SEED, SEED + self.processes):
            words = ["-W", "ignore::UserWarning", "-c", WORK, ROOM, denoiser, str(seed), "3"]
            run = subprocess.run([sys.executable, *words], capture_output=True, text=True, timeout=300, check=False,
                                 preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
            self.assertEqual((run.returncode, run.stdout, run.stderr), (0, "as before\n", ""), f"seed {seed}")


if __name__ == "__main__":
    if sys.argv[-1].isdigit():
        CtrlC.processes = int(sys.argv.pop())
    unittest.main()
