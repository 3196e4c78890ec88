# SPDX-License-Identifier: Apache-2.0
"""Arrays on a device of CUDA, as PyTorch and CuPy have them, with a stand-in for its driver (tests/device)."""
import ctypes
import os
import unittest

import covary
import numpy
from common import PackageTest, pair

CUDA = ctypes.CDLL("libcuda.so.1")
WRITTEN = ctypes.c_size_t.in_dll(CUDA, "stand_in_bytes_written")
CPU, CUDA_DEVICE, OPENCL_DEVICE = 1, 2, 4  # of DLPack


class DlTensor(ctypes.Structure):
    """The DLPack specification's DLManagedTensor."""

    _fields_ = [("data", ctypes.c_void_p), ("device", ctypes.c_int32 * 2), ("ndim", ctypes.c_int32),
                ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16),
                ("shape", ctypes.POINTER(ctypes.c_int64)), ("strides", ctypes.POINTER(ctypes.c_int64)),
                ("byte_offset", ctypes.c_uint64), ("context", ctypes.c_void_p), ("deleter", ctypes.c_void_p)]


class OnDevice:
    """The values of a NumPy array on a device, in the order in memory that they have, with DLPack."""

    def __init__(self, values, kind=CUDA_DEVICE):
        self.shape, self.dtype, self.kind = values.shape, values.dtype, kind
        order = numpy.argsort([-stride for stride in values.strides], kind="stable")
        in_memory = numpy.ascontiguousarray(values.transpose(order))
        self.strides = [in_memory.strides[list(order).index(i)] // 4 for i in range(values.ndim)]
        address = ctypes.c_uint64()
        CUDA.cuInit(0)
        if CUDA.cuMemAlloc_v2(ctypes.byref(address), ctypes.c_size_t(in_memory.nbytes)):
            raise MemoryError
        self.address, self.bytes = address, in_memory.nbytes
        CUDA.cuMemcpyHtoDAsync_v2(address, in_memory.ctypes.data_as(ctypes.c_void_p),
                                  ctypes.c_size_t(in_memory.nbytes), None)

    def __del__(self):
        CUDA.cuMemFree_v2(self.address)

    def __array__(self, *_, **__):
        raise TypeError("can't convert it to numpy")  # as PyTorch says

    def __dlpack_device__(self):
        return self.kind, 0

    def __dlpack__(self, **_):
        size = ctypes.c_int64 * len(self.shape)
        self.tensor = DlTensor(self.address.value, (self.kind, 0), len(self.shape), 2, 32, 1, size(*self.shape),
                               size(*self.strides), 0, None, None)
        new = ctypes.pythonapi.PyCapsule_New
        new.restype, new.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
        return new(ctypes.addressof(self.tensor), b"dltensor", None)


def by_pixels(values):
    """The same array, whose groups lie beside one another in memory."""
    return numpy.ascontiguousarray(values.transpose(1, 2, 0, 3)).transpose(2, 0, 1, 3)


class Cuda(PackageTest):
    def setUp(self):
        super().setUp()
        self.crn, self.independent = pair(height=40, width=48)

    def test_arrays(self):
        """Are those of NumPy to the bit, in any order in memory."""
        expected = covary.combine(self.crn, self.independent, oidn="off")
        for change in (numpy.asarray, by_pixels, numpy.asfortranarray):
            found = covary.combine(OnDevice(change(self.crn)), OnDevice(change(self.independent)), oidn="off")
            self.assert_same_bits(found.image, expected.image)
        of_list = covary.combine([OnDevice(image) for image in self.crn], self.independent, oidn="off")
        self.assert_same_bits(of_list.image, expected.image)
        albedo = numpy.random.default_rng(3).random((40, 48, 3)).astype(numpy.float32)
        of_arrays = covary.combine(None, self.independent, albedo=albedo, oidn="off")
        on_device = covary.combine(None, OnDevice(self.independent), albedo=OnDevice(albedo), oidn="off")
        self.assert_same_bits(on_device.image, of_arrays.image)
        self.assertEqual(covary.metrics.relmse(OnDevice(self.crn[0]), OnDevice(self.crn[1])),
                         covary.metrics.relmse(self.crn[0], self.crn[1]))

    def test_samples_are_not_sent_again(self):
        """To estimators on the same device, in any order in memory."""
        for images, order, options in (((None, self.independent), by_pixels, {"oidn": "off"}),
                                       ((None, self.independent), numpy.asfortranarray, {"oidn": "off"}),
                                       ((self.crn, self.independent), numpy.asarray,
                                        {"estimator": "iduw", "samples": 24})):
            given = [None if image is None else OnDevice(order(image)) for image in images]
            results, written = [], []
            for pair_of_images in (given, images):
                before = WRITTEN.value
                results.append(covary.combine(*pair_of_images, device="cuda", **options).image)
                written.append(WRITTEN.value - before)
            self.assert_same_bits(*results)
            # Besides samples, launches in parts send a few numbers, as often as the clock wants.
            self.assertAlmostEqual((written[1] - written[0]) / sum(array.bytes for array in given if array), 1, 1)

    def test_network(self):
        """Runs on the device, too: the picture is the processor's to rounding."""
        oidn = os.environ["STAND_IN_DENOISER"]
        buffers = self.path / "buffers"
        os.environ["STAND_IN_BUFFERS"] = str(buffers)
        self.addCleanup(os.environ.pop, "STAND_IN_BUFFERS")
        expected = covary.combine(None, self.independent, oidn=oidn)
        self.assertFalse(buffers.exists())
        found = covary.combine(None, self.independent, oidn=oidn, device="cuda")
        self.assertTrue(buffers.exists())
        difference = numpy.abs(found.image - expected.image) / (numpy.abs(expected.image) + 0.01)
        self.assertLess(numpy.quantile(difference, 0.999), 1e-4)

    def test_other_devices_are_refused(self):
        message = self.message_of(TypeError, covary.combine, OnDevice(self.crn, OPENCL_DEVICE), self.independent)
        self.assertIn("on a device that is neither the processor nor CUDA's (tensor.cpu() copies it)", message)


if __name__ == "__main__":
    unittest.main()
