// SPDX-License-Identifier: Apache-2.0
// What lets one kernel text compile as OpenCL C 1.2 and, by NVRTC, as CUDA C++. Kernels are written in OpenCL C, with
// its functions (get_global_id(), fma(), as_int() …), and with these macros where the languages differ:
//
//   KERNEL name(arguments)              a kernel; arguments that point to buffers: GLOBAL const float* RESTRICT p
//   FUNCTION float f(…)                 a function of a kernel file
//   LOCAL float* p                      a pointer to memory of the work group
//   LOCAL_ARRAY(float, name, n);        such memory, n known to the compiler, at the top of a kernel
//   KERNEL f(… LOCAL_ARGUMENT(name))    such memory, whose size the launch gives (LocalMemory), as the last argument,
//     LOCAL_POINTER(name)               and the first line of that kernel's body, which declares LOCAL float* name
//   group_barrier()                     orders the local memory of the work group
//   FLOAT4(a, b, c, d)                  a vector
//   TABLE float t[] = {…};              constants of a kernel file
//   get_group_id(), get_global_id()     count over all launches of a long one that is made in parts (launch_pace.h)
//   UNROLL                              before a loop whose number of steps is constant
//
// PLANTED_BUG is 0 but in tests, whose comparisons must notice a kernel that is slightly wrong.
//
// Products and sums are fused only where a kernel says fma(), as on the processor (filters/lanes.h).
#ifndef PLANTED_BUG
#define PLANTED_BUG 0
#endif
#ifdef __CUDACC_RTC__
#define KERNEL extern "C" __global__ void
#define FUNCTION static __device__ __forceinline__
#define GLOBAL
#define LOCAL
#define LOCAL_ARRAY(type, name, n) __shared__ type name[n]
#define LOCAL_ARGUMENT(name)
#define LOCAL_POINTER(name)               \
  extern __shared__ float4 local_memory[]; \
  float* const name = (float*)local_memory;
#define TABLE static __constant__ const
#define RESTRICT __restrict__
#define UNROLL _Pragma("unroll")
#define FLOAT4(a, b, c, d) make_float4(a, b, c, d)
typedef unsigned int uint;
typedef unsigned short ushort;
typedef unsigned char uchar;
extern "C" __constant__ int first_group[3] = {0, 0, 0};  // set by cuda_backend.cpp
FUNCTION int get_group_id(int d) { return first_group[d] + (d == 0 ? blockIdx.x : d == 1 ? blockIdx.y : blockIdx.z); }
FUNCTION int get_local_id(int d) { return d == 0 ? threadIdx.x : d == 1 ? threadIdx.y : threadIdx.z; }
FUNCTION int get_local_size(int d) { return d == 0 ? blockDim.x : d == 1 ? blockDim.y : blockDim.z; }
FUNCTION int get_global_id(int d) { return get_group_id(d) * get_local_size(d) + get_local_id(d); }
FUNCTION void group_barrier() { __syncthreads(); }
FUNCTION int as_int(float v) { return __float_as_int(v); }
FUNCTION float as_float(int v) { return __int_as_float(v); }
FUNCTION float4 vload4(int i, const float* p) { return ((const float4*)p)[i]; }
FUNCTION void vstore4(float4 v, int i, float* p) { ((float4*)p)[i] = v; }
#else
#pragma OPENCL FP_CONTRACT OFF
#define KERNEL __kernel void
#define FUNCTION static inline
#define GLOBAL __global
#define LOCAL __local
#define LOCAL_ARRAY(type, name, n) __local type name[n]
#define LOCAL_ARGUMENT(name) , __local float* name
#define LOCAL_POINTER(name)
#define TABLE __constant
#define RESTRICT restrict
#define UNROLL __attribute__((opencl_unroll_hint))
#define FLOAT4(a, b, c, d) ((float4)(a, b, c, d))
#define group_barrier() barrier(CLK_LOCAL_MEM_FENCE)
FUNCTION int group_of_all(int d) { return (int)(get_group_id(d) + get_global_offset(d) / get_local_size(d)); }
#define get_group_id(d) group_of_all(d)
#endif

// 2^x for x <= 0; 0 below -126, and for NaN.
FUNCTION float exp2_of_nonpositive(float x) { return x > -126.0f ? exp2(x) : 0.0f; }
FUNCTION float squared_length(float x, float y, float z) { return fma(x, x, fma(y, y, z * z)); }
