// SPDX-License-Identifier: Apache-2.0
// What is said of the error of a denoised image: its size, its bias, and what others would have had.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "denoising/mixed_denoising.h"
#include "estimators/estimator_result.h"

namespace covary {

/// "predicted relMSE 0.0021, 18 % of it squared bias; the mean of the samples has 0.012, Open Image Denoise 0.0025"
std::string risks_text(double predicted, const MeasuredRisks& risks);

/// Lines on stderr: what is missing or to be known, and last the risks.
void print_risks(const EstimatorResult& image, std::optional<double> predicted, const DenoisingChoice& choice);

/// "predicted_bias_share" and "risks"; nothing where they are not known.
void add_risks(const std::optional<MeasuredRisks>& risks, nlohmann::ordered_json& json);

/// "denoiser", the network that took part, and "denoiser_missing": that it could not, and how to get it.
void add_network(const std::string& network, const DenoisingChoice& choice, nlohmann::ordered_json& json);

}  // namespace covary
