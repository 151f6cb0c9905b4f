#include "sensors/camera/imaging/imaging_options.h"

#include "core/error.h"

namespace terracast::sensors {

using core::ErrorKind;
using core::fail;

namespace {

/// A key that counts only with another: given without, it would change nothing.
/// is_given   it differs from its default
/// with       what it counts with, and what to do
/// throws     Config
void refuse_idle(bool is_given, std::string_view key, std::string_view with) {
  if (is_given)
    fail(ErrorKind::Config,
         "{} is given, which counts only with {}; give that too, or leave {} out", key, with, key);
}

}  // namespace

void LensFlawOptions::describe(core::SchemaVisitor& visit) {
  visit.key(
      "vignetting_exponent", vignetting_exponent,
      "Light falls off with this power of the cosine of the angle between a pixel's ray and the "
      "optical axis; 4: natural vignetting of a thin lens, 0: none. Beyond 90 deg it is dark.",
      core::between(0.0, 16.0));
  core::Constraint three = core::between(-10.0, 10.0);
  three.min_size = three.max_size = 3;
  visit.key(
      "vignetting_polynomial", vignetting_polynomial,
      "a2, a4, a6 of 1 + a2 r^2 + a4 r^4 + a6 r^6, by which light falls off besides; r is the "
      "distance from the principal point, 1 at the image's farthest corner. Empty: none.",
      three);
  visit.key(
      "red_scale_permille", red_scale_permille,
      "Lateral chromatic aberration: by how much larger than green the image in red is, about "
      "the principal point.",
      core::between(-20.0, 20.0));
  visit.key("blue_scale_permille", blue_scale_permille, "The same of the image in blue.",
            core::between(-20.0, 20.0));
  visit.key("veiling_glare", veiling_glare,
            "Share of the light that lens and body scatter evenly over the whole image.",
            core::between(0.0, 0.9));
  visit.key("bloom", bloom, "Share of the light that is scattered about where it belongs.",
            core::between(0.0, 0.9));
  visit.key("bloom_radius_px", bloom_radius_px, "How far: standard deviation of a Gaussian.",
            core::between(0.5, 64.0));
}

void LensFlawOptions::validate() const {
  const LensFlawOptions none;
  if (bloom == 0.0)
    refuse_idle(bloom_radius_px != none.bloom_radius_px, "bloom_radius_px", "bloom");
  if (vignetting_polynomial.empty()) return;
  const std::vector<double>& a = vignetting_polynomial;
  for (int step = 0; step <= 100; ++step) {
    const double r2 = step * step * 1e-4;
    const double factor = 1.0 + r2 * (a[0] + r2 * (a[1] + r2 * a[2]));
    if (factor < 0.0)
      fail(ErrorKind::Config,
           "vignetting_polynomial gives {} at r = {}; light cannot be less than none", factor,
           0.01 * step);
  }
}

void SoilingOptions::describe(core::SchemaVisitor& visit) {
  visit.key(
      "smudges", smudges,
      "Smudges on the lens, which scatter light; where they are is drawn for each camera, once "
      "a sequence.",
      core::between(0, 200));
  visit.key("smudge_size", smudge_size, "Their mean radius, as a share of the image's width.",
            core::between(0.005, 0.5));
  visit.key("smudge_haze", smudge_haze, "Share of the light that is scattered in their middle.",
            core::between(0.0, 1.0));
  visit.key("smudge_radius_px", smudge_radius_px,
            "How far it is scattered: standard deviation of a Gaussian.", core::between(0.5, 64.0));
  visit.key("dirt_spots", dirt_spots, "Specks on the lens, which take light; drawn likewise.",
            core::between(0, 2000));
  visit.key("dirt_size", dirt_size, "Their mean radius, as a share of the image's width.",
            core::between(0.001, 0.2));
  visit.key("dirt_opacity", dirt_opacity, "Share of the light that they take in their middle.",
            core::between(0.0, 1.0));
}

void SoilingOptions::validate() const {
  const SoilingOptions none;
  if (smudges == 0) {
    refuse_idle(smudge_size != none.smudge_size, "smudge_size", "smudges");
    refuse_idle(smudge_haze != none.smudge_haze, "smudge_haze", "smudges");
    refuse_idle(smudge_radius_px != none.smudge_radius_px, "smudge_radius_px", "smudges");
  }
  if (dirt_spots == 0) {
    refuse_idle(dirt_size != none.dirt_size, "dirt_size", "dirt_spots");
    refuse_idle(dirt_opacity != none.dirt_opacity, "dirt_opacity", "dirt_spots");
  }
}

void ExposureOptions::describe(core::SchemaVisitor& visit) {
  visit.key(
      "mode", mode,
      "fixed: as the light of the whole sequence wants it (`conditions.exposure`); automatic: as "
      "each frame does, and those before it.",
      core::one_of({"fixed", "automatic"}));
  visit.key("bias_ev", bias_ev, "Exposure by so many stops more, in either mode.",
            core::between(-10.0, 10.0));
  visit.key("meter", meter,
            "What an automatic exposure looks at: the mean of the luminances' logarithms, or a "
            "percentile of the luminances.",
            core::one_of({"log_average", "percentile"}));
  visit.key("meter_percentile", meter_percentile, "Which percentile.", core::between(1.0, 100.0));
  visit.key("target", target,
            "What the metered luminance shall become, as a share of white, before the curve.",
            core::between(0.001, 1.0));
  visit.key(
      "time_constant_s", time_constant_s,
      "Automatic exposure follows the light so slowly: after this time a step is made by 63 %. "
      "0: at once.",
      core::between(0.0, 10.0));
  visit.key("lowest_ev", lowest_ev,
            "An automatic exposure is at least so many stops above the fixed one, bias apart.",
            core::between(-20.0, 20.0));
  visit.key("highest_ev", highest_ev, "… and at most so many.", core::between(-20.0, 20.0));
  visit.key(
      "lock", lock,
      "Whose frames an automatic exposure is metered by: those of all the rig's cameras, which "
      "then share it, or each camera's own.",
      core::one_of({"rig", "camera"}));
}

void ExposureOptions::validate() const {
  if (lowest_ev > highest_ev)
    fail(ErrorKind::Config, "lowest_ev = {} is above highest_ev = {}", lowest_ev, highest_ev);
  const ExposureOptions none;
  if (meter != "percentile")
    refuse_idle(meter_percentile != none.meter_percentile, "meter_percentile",
                "meter = \"percentile\"");
  if (is_automatic()) return;
  constexpr const char* kAutomatic = "mode = \"automatic\"";
  refuse_idle(meter != none.meter, "meter", kAutomatic);
  refuse_idle(target != none.target, "target", kAutomatic);
  refuse_idle(time_constant_s != none.time_constant_s, "time_constant_s", kAutomatic);
  refuse_idle(lowest_ev != none.lowest_ev, "lowest_ev", kAutomatic);
  refuse_idle(highest_ev != none.highest_ev, "highest_ev", kAutomatic);
  refuse_idle(lock != none.lock, "lock", kAutomatic);
}

void ImageSensorOptions::describe(core::SchemaVisitor& visit) {
  visit.key(
      "bits", bits,
      "Bits of the converter to digital numbers, 8 to 16. 0: no sensor, light goes on as it is.",
      core::between(0, 16));
  visit.key("black_level_dn", black_level_dn, "Digital number without light and dark signal.",
            core::between(0.0, 16384.0));
  visit.key("saturation_exposure", saturation_exposure,
            "Exposure of the highest digital number, 1 being white before the curve.",
            core::between(0.1, 64.0));
  visit.key("full_well_e", full_well_e,
            "Electrons of the highest digital number at gain 1: shot noise follows from it. 0: no "
            "noise of any kind.",
            core::between(0.0, 1e7));
  visit.key("gain", gain,
            "Analog gain: the highest digital number stands for as many times fewer electrons, and "
            "the exposure is as many times less.",
            core::between(0.1, 1000.0));
  visit.key("read_noise_e", read_noise_e,
            "Standard deviation of the noise of reading, in electrons.",
            core::between(0.0, 1000.0));
  visit.key("dark_signal_e", dark_signal_e,
            "Electrons that gather in the dark during an exposure; they have shot noise too.",
            core::between(0.0, 1e5));
  visit.key("prnu_percent", prnu_percent,
            "Photo response non-uniformity: standard deviation of the pixels' sensitivities.",
            core::between(0.0, 50.0));
  visit.key(
      "dsnu_e", dsnu_e,
      "Dark signal non-uniformity: standard deviation of the pixels' dark signals, in electrons.",
      core::between(0.0, 1e4));
  visit.key("dead_share", dead_share, "Share of the pixels that see no light.",
            core::between(0.0, 0.01));
  visit.key("hot_share", hot_share, "Share of the pixels that are always full.",
            core::between(0.0, 0.01));
  visit.key(
      "mosaic", mosaic,
      "Color filters of the pixels, from the top left one: the capture also holds the raw digital "
      "numbers, and the colour image is made of them. Empty: each pixel sees all three colours.",
      core::one_of({"", "rggb", "bggr", "grbg", "gbrg"}));
}

void ImageSensorOptions::validate() const {
  if (bits != 0 && bits < 8)
    fail(ErrorKind::Config, "bits = {}; it takes 8 to 16, or 0 for no sensor", bits);
  if (!is_on()) {
    ImageSensorOptions none;
    none.saturation_exposure = saturation_exposure;
    if (*this != none)
      fail(ErrorKind::Config,
           "keys of a sensor are given, but bits = 0 leaves it out; give bits = 8 to 16");
    return;
  }
  if (black_level_dn >= static_cast<double>((1 << bits) - 1))
    fail(ErrorKind::Config, "black_level_dn = {} leaves nothing of the {} numbers of {} bits",
         black_level_dn, 1 << bits, bits);
  const bool has_noise =
      read_noise_e > 0.0 || dark_signal_e > 0.0 || prnu_percent > 0.0 || dsnu_e > 0.0;
  if (has_noise && !(full_well_e > 0.0))
    fail(ErrorKind::Config,
         "read_noise_e, dark_signal_e, prnu_percent or dsnu_e is given without full_well_e, which "
         "says how much light an electron is");
  if (gain != 1.0 && !(full_well_e > 0.0))
    fail(ErrorKind::Config,
         "gain = {} without full_well_e, which says how many electrons are full; give full_well_e, "
         "or "
         "leave gain out",
         gain);
}

void ColorOptions::describe(core::SchemaVisitor& visit) {
  visit.key(
      "white_balance", white_balance,
      "scene: a level white board in the sequence's light is white; temperature: light of "
      "temperature_k is; gains: as given; grey_world: the mean of the sequence's first frame is "
      "grey, for the rig.",
      core::one_of({"scene", "temperature", "gains", "grey_world"}));
  visit.key("temperature_k", temperature_k, "Temperature of a black body whose light is white.",
            core::between(2000.0, 25000.0));
  core::Constraint three = core::between(0.01, 100.0);
  three.min_size = three.max_size = 3;
  visit.key("gains", gains, "Factors on red, green and blue, of white_balance = \"gains\".", three);
  visit.key("saturation", saturation,
            "Distance of colours from their grey, before the curve; 1: as it is, 0: grey.",
            core::between(0.0, 4.0));
  visit.key(
      "curve", curve,
      "From light to the values of the image: film (linear to 0.5 of white with a shoulder above, "
      "then sRGB), srgb, gamma (its power 1 / gamma), linear.",
      core::one_of({"film", "srgb", "gamma", "linear"}));
  visit.key("gamma", gamma, "Of curve = \"gamma\".", core::between(0.5, 5.0));
}

void ColorOptions::validate() const {
  if ((white_balance == "gains") != !gains.empty())
    fail(ErrorKind::Config,
         "white_balance = \"{}\" with {} gains; white_balance = \"gains\" and three gains go "
         "together",
         white_balance, gains.size());
  const ColorOptions none;
  if (white_balance != "temperature")
    refuse_idle(temperature_k != none.temperature_k, "temperature_k",
                "white_balance = \"temperature\"");
  if (curve != "gamma") refuse_idle(gamma != none.gamma, "gamma", "curve = \"gamma\"");
}

void ImagingOptions::describe(core::SchemaVisitor& visit) {
  visit.section("lens", lens, "What the lens does to light on its way.");
  visit.section("soiling", soiling, "What lies on the lens.");
  visit.section("exposure", exposure, "How much light is taken.");
  visit.section("sensor", sensor, "From light to electrons to digital numbers.");
  visit.section("color", color, "From digital numbers to the values of the image.");
}

}  // namespace terracast::sensors
