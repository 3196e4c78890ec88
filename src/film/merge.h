// SPDX-License-Identifier: Apache-2.0
// Merging: one film with all samples of several films.
//
// Films are ordered by their smallest seeds, so that the result does not depend on the order given, bit for bit. A
// pixel's samples are numbered consecutively across films: if the first has n samples, sample s of the second becomes
// sample n + s of the merged film, and so group g becomes group (n + g) mod T. The merged mean of a group is (sum_i n_i
// m_i) / (sum_i n_i), n_i being the sizes of the groups merged into it, accumulated in double over all films and then
// rounded to float.
#pragma once

#include <span>
#include <string>

#include "film/film.h"

namespace covary {

/// Throws Error(kInput) when the films differ in frame, crop, groups, sampling, scene hash, settings, the list of
/// auxiliary images or in whether they keep the sample variance; when two share a seed, and so contain the same
/// samples; when a pixel would have more than 2^32 - 1 samples; when films of common random numbers have counts that
/// would shift the groups of pixels differently, so that these would no longer share random numbers; and when light
/// films and others are mixed. `names` identify the films in error messages. Attributes that all films share are kept,
/// as are all seeds; `complete` is "true" if all films are complete.
Film merge_films(std::span<const Film> films, std::span<const std::string> names);

/// Same for film files, of which only one is in memory at a time.
Film merge_film_files(std::span<const std::string> paths);

}  // namespace covary
