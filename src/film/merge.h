// SPDX-License-Identifier: Apache-2.0
// Merging: the film of all samples of several films.
//
// Per pixel and group the merged mean is (sum_i n_i m_i) / (sum_i n_i), in double over all films at once, rounded to
// float. Films are taken in the order of their smallest seeds, so the order given does not matter, bit for bit.
#pragma once

#include <span>
#include <string>

#include "film/film.h"

namespace covary {

/// Throws Error(kInput) when the films differ in frame, crop, groups, sampling, scene hash, settings or the list of
/// auxiliary images, or when two share a seed, because then they hold the same samples. `names` stand for the films in
/// error messages. Of the attributes those remain that all films share, and all seeds; `complete` is "true" when all are.
Film merge_films(std::span<const Film> films, std::span<const std::string> names);

/// The same for films in files, of which only one is in memory at a time.
Film merge_film_files(std::span<const std::string> paths);

}  // namespace covary
