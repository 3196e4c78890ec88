// SPDX-License-Identifier: Apache-2.0
// Merging: the film of all samples of several films.
//
// Films are taken in the order of their smallest seeds, so the order given does not matter, bit for bit. The samples of
// a pixel are numbered on from film to film: where the first has n samples, sample s of the second is sample n + s of
// the merged film, and so group g becomes group (n + g) mod T. Per group the merged mean is (sum_i n_i m_i) / (sum_i
// n_i) with the sizes n_i of the groups that meet, in double over all films at once, rounded to float.
#pragma once

#include <span>
#include <string>

#include "film/film.h"

namespace covary {

/// Throws Error(kInput) when the films differ in frame, crop, groups, sampling, scene hash, settings or the list of
/// auxiliary images, or when two share a seed, because then they hold the same samples; and when films of common random
/// numbers have counts that would move the groups of pixels differently, which then would not share their random
/// numbers any more; and when light films and others are mixed. `names` stand for the films in error messages. Of the
/// attributes those remain that all films share, and all seeds; `complete` is "true" when all are.
Film merge_films(std::span<const Film> films, std::span<const std::string> names);

/// The same for films in files, of which only one is in memory at a time.
Film merge_film_files(std::span<const std::string> paths);

}  // namespace covary
