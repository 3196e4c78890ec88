// SPDX-License-Identifier: Apache-2.0
// Spectra that pbrt scenes name: metals, glasses, illuminants, media, files.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "formats/xml_values.h"
#include "pbrt/pbrt_objects.h"

namespace covary {
namespace {

/// pbrt's metals (spectrum.cpp) in linear Rec. 709 RGB, by the sums of spectrum_to_rgb() with SpectrumRole::kIndex.
struct Metal {
  const char* name;
  Spectrum eta, k;
};
const Metal kMetals[] = {
    {"Ag", {0.12849f, 0.12353f, 0.15088f}, {4.06518f, 3.28615f, 2.39157f}},
    {"Al", {1.40751f, 0.92664f, 0.58402f}, {7.74094f, 6.60235f, 5.35991f}},
    {"Au", {0.07996f, 0.4051f, 1.5607f}, {3.3905f, 2.50348f, 1.77087f}},
    {"Cu", {0.10517f, 0.9779f, 1.20456f}, {3.27379f, 2.59248f, 2.36897f}},
    {"CuZn", {0.41844f, 0.52008f, 1.12293f}, {3.66793f, 2.68058f, 1.77125f}},
    {"MgO", {1.73384f, 1.74092f, 1.75339f}, {0, 0, 0}},
    {"TiO2", {2.86065f, 2.95648f, 3.18524f}, {0.00009f, 0, 0.00057f}},
};

/// Glasses (spectrum.cpp) at 589 nm; those of Schott's SF glasses are named 'glass-F…' in the program and 'glass-SF…'
/// in its documentation.
const std::map<std::string, double> kGlasses = {
    {"glass-BK7", 1.5168},   {"glass-BAF10", 1.67003}, {"glass-FK51A", 1.48656}, {"glass-LASF9", 1.85025},
    {"glass-F5", 1.67271},   {"glass-F10", 1.72828},   {"glass-F11", 1.78472},   {"glass-SF5", 1.67271},
    {"glass-SF10", 1.72828}, {"glass-SF11", 1.78472}};

/// Chromaticities (x, y) of the CIE's illuminants [CIE 15:2004, Tables T.3 and T.8], of the ACES white point.
struct Illuminant {
  const char* name;
  double x, y;
};
constexpr Illuminant kIlluminants[] = {
    {"stdillum-A", .44757, .40745},    {"stdillum-D50", .34567, .35850}, {"stdillum-D65", .31271, .32902},
    {"illum-acesD60", .32168, .33767}, {"stdillum-F1", .3131, .3371},    {"stdillum-F2", .3721, .3751},
    {"stdillum-F3", .4091, .3941},     {"stdillum-F4", .4402, .4031},    {"stdillum-F5", .3138, .3452},
    {"stdillum-F6", .3779, .3882},     {"stdillum-F7", .3129, .3292},    {"stdillum-F8", .3458, .3586},
    {"stdillum-F9", .3741, .3727},     {"stdillum-F10", .3458, .3588},   {"stdillum-F11", .3805, .3769},
    {"stdillum-F12", .4370, .4042}};

/// Reduced scattering and absorption per mm: [Jensen2001], Fig. 5, and [Narasimhan2006], Table 1, by
/// pbrt's names.
const PbrtMediumPreset kMedia[] = {
    {"Apple", {2.29f, 2.39f, 1.97f}, {0.0030f, 0.0034f, 0.046f}},
    {"Chicken1", {0.15f, 0.21f, 0.38f}, {0.015f, 0.077f, 0.19f}},
    {"Chicken2", {0.19f, 0.25f, 0.32f}, {0.018f, 0.088f, 0.20f}},
    {"Cream", {7.38f, 5.47f, 3.15f}, {0.0002f, 0.0028f, 0.0163f}},
    {"Ketchup", {0.18f, 0.07f, 0.03f}, {0.061f, 0.97f, 1.45f}},
    {"Marble", {2.19f, 2.62f, 3.00f}, {0.0021f, 0.0041f, 0.0071f}},
    {"Potato", {0.68f, 0.70f, 0.55f}, {0.0024f, 0.0090f, 0.12f}},
    {"Skimmilk", {0.70f, 1.22f, 1.90f}, {0.0014f, 0.0025f, 0.0142f}},
    {"Skin1", {0.74f, 0.88f, 1.01f}, {0.032f, 0.17f, 0.48f}},
    {"Skin2", {1.09f, 1.59f, 1.79f}, {0.013f, 0.070f, 0.145f}},
    {"Spectralon", {11.6f, 20.4f, 14.9f}, {0.00f, 0.00f, 0.00f}},
    {"Wholemilk", {2.55f, 3.21f, 3.77f}, {0.0011f, 0.0024f, 0.014f}},
    // Narasimhan et al.
    {"Lowfat Milk", {0.89187f, 1.5136f, 2.532f}, {0.002875f, 0.00575f, 0.0115f}},
    {"Reduced Milk", {2.4858f, 3.1669f, 4.5214f}, {0.0025556f, 0.0051111f, 0.012778f}},
    {"Regular Milk", {4.5513f, 5.8294f, 7.136f}, {0.0015333f, 0.0046f, 0.019933f}},
    {"Espresso", {0.72378f, 0.84557f, 1.0247f}, {4.7984f, 6.5751f, 8.8493f}},
    {"Mint Mocha Coffee", {0.31602f, 0.38538f, 0.48131f}, {3.772f, 5.8228f, 7.82f}},
    {"Lowfat Soy Milk", {0.30576f, 0.34233f, 0.61664f}, {0.0014375f, 0.0071875f, 0.035937f}},
    {"Regular Soy Milk", {0.59223f, 0.73866f, 1.4693f}, {0.0019167f, 0.0095833f, 0.065167f}},
    {"Lowfat Chocolate Milk", {0.64925f, 0.83916f, 1.1057f}, {0.0115f, 0.0368f, 0.1564f}},
    {"Regular Chocolate Milk", {1.4585f, 2.1289f, 2.9527f}, {0.010063f, 0.043125f, 0.14375f}},
    {"Coke", {8.9053e-05f, 8.372e-05f, 0.0f}, {0.10014f, 0.16503f, 0.2468f}},
    {"Pepsi", {6.1697e-05f, 4.2564e-05f, 0.0f}, {0.091641f, 0.14158f, 0.20729f}},
    {"Sprite", {6.0306e-06f, 6.4139e-06f, 6.5504e-06f}, {0.001886f, 0.0018308f, 0.0020025f}},
    {"Gatorade", {0.0024574f, 0.003007f, 0.0037325f}, {0.024794f, 0.019289f, 0.008878f}},
    {"Chardonnay", {1.7982e-05f, 1.3758e-05f, 1.2023e-05f}, {0.010782f, 0.011855f, 0.023997f}},
    {"White Zinfandel", {1.7501e-05f, 1.9069e-05f, 1.288e-05f}, {0.012072f, 0.016184f, 0.019843f}},
    {"Merlot", {2.1129e-05f, 0.0f, 0.0f}, {0.11632f, 0.25191f, 0.29434f}},
    {"Budweiser Beer", {2.4356e-05f, 2.4079e-05f, 1.0564e-05f}, {0.011492f, 0.024911f, 0.057786f}},
    {"Coors Light Beer", {5.0922e-05f, 4.301e-05f, 0.0f}, {0.006164f, 0.013984f, 0.034983f}},
    {"Clorox", {0.0024035f, 0.0031373f, 0.003991f}, {0.0033542f, 0.014892f, 0.026297f}},
    {"Apple Juice", {0.00013612f, 0.00015836f, 0.000227f}, {0.012957f, 0.023741f, 0.052184f}},
    {"Cranberry Juice", {0.00010402f, 0.00011646f, 7.8139e-05f}, {0.039437f, 0.094223f, 0.12426f}},
    {"Grape Juice", {5.382e-05f, 0.0f, 0.0f}, {0.10404f, 0.23958f, 0.29325f}},
    {"Ruby Grapefruit Juice", {0.011002f, 0.010927f, 0.011036f}, {0.085867f, 0.18314f, 0.25262f}},
    {"White Grapefruit Juice", {0.22826f, 0.23998f, 0.32748f}, {0.0138f, 0.018831f, 0.056781f}},
    {"Shampoo", {0.0007176f, 0.0008303f, 0.0009016f}, {0.014107f, 0.045693f, 0.061717f}},
    {"Strawberry Shampoo", {0.00015671f, 0.00015947f, 1.518e-05f}, {0.01449f, 0.05796f, 0.075823f}},
    {"Head & Shoulders Shampoo", {0.023805f, 0.028804f, 0.034306f}, {0.084621f, 0.15688f, 0.20365f}},
    {"Lemon Tea Powder", {0.040224f, 0.045264f, 0.051081f}, {2.4288f, 4.5757f, 7.2127f}},
    {"Orange Powder", {0.00015617f, 0.00017482f, 0.0001762f}, {0.001449f, 0.003441f, 0.007863f}},
    {"Pink Lemonade Powder", {0.00012103f, 0.00013073f, 0.00012528f}, {0.001165f, 0.002366f, 0.003195f}},
    {"Cappuccino Powder", {1.8436f, 2.5851f, 2.1662f}, {35.844f, 49.547f, 61.084f}},
    {"Salt Powder", {0.027333f, 0.032451f, 0.031979f}, {0.28415f, 0.3257f, 0.34148f}},
    {"Sugar Powder", {0.00022272f, 0.00025513f, 0.000271f}, {0.012638f, 0.031051f, 0.050124f}},
    {"Suisse Mocha Powder", {2.7979f, 3.5452f, 4.3365f}, {17.502f, 27.004f, 35.433f}},
    {"Pacific Ocean Surface Water", {0.0001764f, 0.00032095f, 0.00019617f}, {0.031845f, 0.031324f, 0.030147f}},
};

}  // namespace

std::optional<Spectrum> pbrt_metal(const std::string& name) {
  std::string stem = std::filesystem::path(name).filename().string();
  // Files of version 3 are "metals/Cu.eta.spd", "spds/Cu.k.spd".
  if (stem.ends_with(".spd")) stem.erase(stem.size() - 4);
  for (const Metal& metal : kMetals)
    for (const bool k : {false, true})
      for (const char* form : {"metal-{}-{}", "{}.{}"})
        if (stem == fmt::format(fmt::runtime(form), metal.name, k ? "k" : "eta")) return k ? metal.k : metal.eta;
  return std::nullopt;
}

std::string pbrt_metal_names(const std::string& of) {
  std::string known;
  for (const Metal& metal : kMetals) known += fmt::format("{}'metal-{}-{}'", known.empty() ? "" : ", ", metal.name, of);
  return known;
}

std::optional<double> pbrt_glass(const std::string& name) {
  const auto glass = kGlasses.find(name);
  return glass == kGlasses.end() ? std::nullopt : std::optional(glass->second);
}

std::optional<Spectrum> pbrt_illuminant(const std::string& name) {
  for (const Illuminant& illuminant : kIlluminants) {
    if (name != illuminant.name) continue;
    const double x = illuminant.x / illuminant.y, z = (1 - illuminant.x - illuminant.y) / illuminant.y;
    const auto channel = [&](double a, double b, double c) {
      return static_cast<float>(std::max(a * x + b + c * z, 0.0));
    };
    const Spectrum rgb(channel(3.240479, -1.537150, -0.498535), channel(-0.969256, 1.875991, 0.041556),
                       channel(0.055648, -0.204043, 1.057311));
    return rgb / luminance(rgb);
  }
  return std::nullopt;
}

std::optional<SampledSpectrum> pbrt_spectrum_file(PbrtParameters& p, const PbrtParameter& parameter, PbrtNames& names) {
  Diagnostics missing;
  const std::string path = names.files().resolve(parameter.strings[0], parameter.where, missing);
  try {
    missing.throw_if_errors();
    return parse_spectrum_file(FileView(path).text());
  } catch (const Error& error) {
    p.error_at(parameter,
               fmt::format("names the spectrum '{}', which is neither one of pbrt's nor a file of wavelengths "
                           "and values: {}",
                           parameter.strings[0], error.what()));
    return std::nullopt;
  }
}

SampledSpectrum pbrt_blackbody(double temperature) {
  // Planck's law, relative to its maximum, which Wien's displacement law places.
  const auto planck = [&](double nanometres) {
    return std::pow(nanometres, -5) / std::expm1(1.438777e7 / (nanometres * temperature));
  };
  const double maximum = planck(2.8977721e6 / temperature);
  SampledSpectrum spectrum;
  for (int nm = 360; nm <= 830; ++nm)
    spectrum.samples.emplace_back(static_cast<float>(nm), static_cast<float>(planck(nm) / maximum));
  return spectrum;
}

const PbrtMediumPreset* pbrt_medium_preset(const std::string& name) {
  const auto* found = std::ranges::find_if(kMedia, [&](const PbrtMediumPreset& m) { return name == m.name; });
  return found == std::end(kMedia) ? nullptr : found;
}

}  // namespace covary
