// SPDX-License-Identifier: Apache-2.0
// Sums of values in an order that depends on their number alone.
//
// Definitions: GROUP, items of the work group, a power of two.
// Compiled: GROUP=256
#include "portable.h"

// The sum of `n` values by one work group of GROUP items: item i adds i, i + GROUP, …; then the items are added in
// pairs, as a tree.
KERNEL sum(GLOBAL const float* RESTRICT values, int n, GLOBAL float* RESTRICT result) {
  LOCAL_ARRAY(float, partial, GROUP);
  const int item = get_local_id(0);
  float own = 0.0f;
  for (int i = item; i < n; i += GROUP) own += values[i];
  partial[item] = own;
  for (int other = GROUP / 2; other > 0; other /= 2) {
    group_barrier();
    if (item < other) partial[item] += partial[item + other];
  }
  if (item == 0) result[0] = partial[0];
}

// The same through local memory that the launch gives; for tests of the modules that launch kernels.
KERNEL sum_in_given_memory(GLOBAL const float* RESTRICT values, int n,
                           GLOBAL float* RESTRICT result LOCAL_ARGUMENT(partial)) {
  LOCAL_POINTER(partial)
  const int item = get_local_id(0);
  float own = 0.0f;
  for (int i = item; i < n; i += GROUP) own += values[i];
  partial[item] = own;
  group_barrier();
  if (item > 0) return;
  for (int i = 1; i < GROUP; ++i) own += partial[i];
  result[0] = own;
}
