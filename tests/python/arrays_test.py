# SPDX-License-Identifier: Apache-2.0
"""Arrays of any layout and kind, and those that are refused."""
import array
import gc
import multiprocessing
import threading
import time
import tracemalloc
import unittest

import covary
import numpy
from common import GROUPS, PackageTest, pair

CRN, INDEPENDENT = pair()
EXPECTED = covary.combine(CRN, INDEPENDENT).image


class DlpackOnly:
    """An array that offers DLPack and no buffer, as those of other packages do."""

    def __init__(self, values):
        self.values = values

    def __dlpack__(self, **keywords):
        return self.values.__dlpack__(**keywords)

    def __dlpack_device__(self):
        return self.values.__dlpack_device__()


class Layouts(PackageTest):
    def combined(self, change):
        return covary.combine(change(CRN), change(INDEPENDENT)).image

    def test_result(self):
        self.assertEqual((EXPECTED.shape, EXPECTED.dtype), (CRN.shape[1:], numpy.float32))

    def test_memory_in_the_order_of_estimators(self):
        self.assert_same_bits(EXPECTED, self.combined(lambda a: a.transpose(1, 2, 0, 3).copy().transpose(2, 0, 1, 3)))

    def test_other_orders_and_strides(self):
        padded = lambda a: numpy.pad(a, ((0, 0), (1, 2), (3, 4), (0, 1)))[:, 1:-2, 3:-4, :3]  # noqa: E731
        every_second = lambda a: numpy.repeat(a, 2, 2)[:, :, ::2]  # noqa: E731
        self.assertEqual(padded(CRN).strides[1] % 4, 0)
        for change in (padded, every_second, numpy.asfortranarray):
            self.assert_same_bits(EXPECTED, self.combined(change))

    def test_negative_strides(self):
        for backwards in ((slice(None, None, -1),), (slice(None), slice(None, None, -1), slice(None, None, -1))):
            with_copy = covary.combine(CRN[backwards].copy(), INDEPENDENT[backwards].copy()).image
            self.assert_same_bits(with_copy, covary.combine(CRN[backwards], INDEPENDENT[backwards]).image)

    def test_read_only(self):
        def fixed(values):
            values = values.copy()
            values.flags.writeable = False
            return values
        self.assert_same_bits(EXPECTED, self.combined(fixed))

    def test_dlpack_and_buffers(self):
        self.assert_same_bits(EXPECTED, self.combined(DlpackOnly))
        self.assert_same_bits(EXPECTED, self.combined(lambda a: memoryview(a.tobytes()).cast("B").cast("f", a.shape)))

    def test_groups_last(self):
        """Are recognised in large images, and said."""
        random = numpy.random.default_rng(5)
        images = [random.gamma(2, 0.5, (12, 70, 80, 3)).astype(numpy.float32) for _ in range(2)]
        expected = covary.combine(*images, "iicv", force=True)
        result = covary.combine(*(image.transpose(1, 2, 0, 3) for image in images), "iicv", force=True)
        self.assert_same_bits(result.image, expected.image)
        self.assertEqual([text for text in result.warnings if "taken for" in text],
                         [f"{name}: the shape [70, 80, 12, 3] was taken for [H, W, T, 3]; expected [T, H, W, 3]"
                          for name in ("crn", "independent")])
        self.assertEqual(covary.check_inputs(*(image.transpose(1, 2, 0, 3) for image in images)).crn_mean,
                         covary.check_inputs(*images).crn_mean)

    def test_groups_that_may_be_last_are_told(self):
        """Of small images, which are read as they should be."""
        image = numpy.random.default_rng(6).gamma(2, 0.5, (48, 64, 8, 3)).astype(numpy.float32)
        result = covary.combine(None, image, "none", denoise="auto", oidn="off", force=True)
        self.assertEqual(result.image.shape, (64, 8, 3))
        self.assertIn("independent: the shape [48, 64, 8, 3] was read as [T, H, W, 3], 48 groups of 8 x 64 pixels, so "
                      "that arrays [H, W, T, 3] need .transpose(2, 0, 1, 3)", result.warnings)

    def test_inputs_stay_as_they_are(self):
        crn, independent = CRN.copy(), INDEPENDENT.copy()
        covary.combine(crn, independent)
        self.assert_same_bits(crn, CRN)
        self.assert_same_bits(independent, INDEPENDENT)


class BadArrays(PackageTest):
    def refused(self, crn, independent=INDEPENDENT, error=ValueError, **keywords):
        return self.message_of(error, covary.combine, crn, independent, **keywords)

    def test_types(self):
        for found, values in (("list", CRN.tolist()), ("int", 1), ("numpy.ndarray of float64", CRN.astype("f8")),
                              ("numpy.ndarray of float16", CRN.astype("f2")),
                              ("numpy.ndarray of >f4", CRN.astype(">f4")), ("numpy.ndarray of int32", CRN.astype("i4")),
                              ("array.array", array.array("d", [1.0]))):
            message = self.refused(values, error=TypeError)
            self.assertTrue(message.startswith(f"crn: found {found}; expected an array of NumPy"), message)
            self.assertIn("of float32 [T, H, W, 3]", message)
        self.assertIn("independent: found", self.refused(CRN, None, TypeError))
        self.assertIn("; numpy.stack(images) makes one of several", self.refused(CRN, [3, 4], TypeError))
        self.assertIn("found arrays of the shapes [20, 24, 3], [19, 24, 3]",
                      self.refused(CRN, [INDEPENDENT[0], INDEPENDENT[1][1:]], ValueError))
        self.assertTrue(self.refused(None, error=covary.UsageError, denoise="none").startswith(
            "denoise: found 'none'; without crn, images are only denoised"))

    def test_shapes(self):
        for shape, values in (("[20, 24, 3]", CRN[0]), ("[12, 20, 24, 2]", CRN[..., :2]),
                              ("[0, 20, 24, 3], without values", CRN[:0]),
                              ("[12, 20, 0, 3], without values", CRN[:, :, :0])):
            self.assertEqual(self.refused(values), f"crn: found the shape {shape}; expected [T, H, W, 3]")
        self.assertIn("the CRN image is 24 x 20 and the independent image 24 x 19",
                      self.refused(CRN, INDEPENDENT[:, 1:]))

    def test_few_groups(self):
        self.assertIn("the CRN image has 2 groups, at least 3 are needed",
                      self.refused(CRN[:2], INDEPENDENT[:2], covary.UsageError, force=True))
        huge = numpy.broadcast_to(CRN[:1], (1025, *CRN.shape[1:]))
        self.assertEqual(self.refused(huge), "crn: found 1025 groups; at most 1024 are accepted")

    def test_not_finite(self):
        holed = CRN.copy()
        holed[3, 2, 1, 0] = numpy.nan
        result = covary.combine(holed, INDEPENDENT)
        self.assertEqual(result.nonfinite_pixels, 1)
        self.assertIn("CRN image: 1 of 480 pixels hold NaN, infinite or overflowing values, the first at (1, 2) in "
                      "render 4", result.warnings[0])
        holed[:, :, :8] = numpy.nan
        message = self.refused(holed, error=covary.InputError)
        self.assertTrue(message.endswith("(force=True combines them anyway)"))

    def test_swapped(self):
        self.assertIn("swapped", self.refused(INDEPENDENT, CRN, covary.InputError))

    def test_options(self):
        self.assertIn("did you mean 'iicv'?", self.refused(CRN, estimator="iicvv", error=covary.UsageError))
        self.assertIn("did you mean 'window'?", self.refused(CRN, windo=3, error=covary.UsageError))
        self.assertIn("k: found [3] (list)", self.refused(CRN, k=[3], error=TypeError))


def combine_in_child(queue):
    try:
        covary.combine(CRN, INDEPENDENT)
        queue.put("no error")
    except covary.UsageError as error:
        queue.put(str(error))


class Calls(PackageTest):
    def test_threads_call_at_once(self):
        results = [None] * 4

        def call(index):
            results[index] = covary.combine(CRN, INDEPENDENT).image
        threads = [threading.Thread(target=call, args=(i,)) for i in range(len(results))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for result in results:
            self.assert_same_bits(EXPECTED, result)

    def test_arrays_that_change_during_a_call(self):
        """Values are then those of some moment; nothing else happens."""
        crn, independent, done = CRN.copy(), INDEPENDENT.copy(), threading.Event()

        def change():
            while not done.is_set():
                crn[:, 5] += 1e-3
        thread = threading.Thread(target=change)
        thread.start()
        try:
            for _ in range(10):
                self.assertEqual(covary.combine(crn, independent, force=True).image.shape, EXPECTED.shape)
        finally:
            done.set()
            thread.join()

    def test_fork_after_use(self):
        context = multiprocessing.get_context("fork")
        queue = context.Queue()
        child = context.Process(target=combine_in_child, args=(queue,))
        child.start()
        message = queue.get(timeout=60)
        child.join()
        self.assertIn("covary was used before this process was forked", message)

    def test_progress(self):
        seen = []
        covary.combine(CRN, INDEPENDENT, progress=lambda done, total: seen.append((done, total)))
        self.assertEqual(seen[-1], (2, 2))

        def fail(done, total):
            raise RuntimeError("enough")
        self.assertEqual(self.message_of(RuntimeError, covary.combine, CRN, INDEPENDENT, progress=fail), "enough")

    def test_gil_is_released(self):
        """Another thread of Python goes on while a call takes long."""
        crn, independent = pair(height=160, width=160)
        beats, done = [], threading.Event()

        def beat():
            while not done.wait(0.001):
                beats.append(time.monotonic())
        thread = threading.Thread(target=beat)
        thread.start()
        covary.combine(crn, independent)
        done.set()
        thread.join()
        self.assertGreater(len(beats), 10)

    def test_no_leak(self):
        """Neither memory of Python nor of the library grows over 1,000 calls."""
        crn, independent = pair(height=8, width=8)
        resident = []
        tracemalloc.start()
        for call in range(1000):
            if call in (200, 999):
                gc.collect()
                resident.append((tracemalloc.get_traced_memory()[0], resident_pages()))
            try:
                covary.combine(crn, independent, force=True)
                covary.combine(crn[:1], independent, force=True)
            except covary.UsageError:
                pass
        tracemalloc.stop()
        (python_before, pages_before), (python_after, pages_after) = resident
        self.assertLess(python_after - python_before, 100_000)
        self.assertLess((pages_after - pages_before) * 4096, 8 << 20)  # 10 kB a call; one image alone has 9 kB


    def test_no_growth_under_threads(self):
        """Calls of threads that come and go."""
        crn, independent = pair(height=8, width=8)

        def calls():
            for _ in range(10):
                covary.combine(crn, independent, force=True)
        resident = []
        for batch in range(40):
            threads = [threading.Thread(target=calls) for _ in range(3)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            if batch in (9, 39):
                gc.collect()
                resident.append(resident_pages())
        self.assertLess((resident[1] - resident[0]) * 4096, 8 << 20)  # 9 kB for each of 900 calls


def resident_pages():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1])


if __name__ == "__main__":
    assert CRN.shape[0] == GROUPS
    unittest.main()
