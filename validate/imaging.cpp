#include "validate/imaging.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/printable.h"
#include "validate/dataset.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

/// "lens.red_scale_permille" to "20.0"; strings without their quotes.
std::map<std::string, std::string> entries_of(const std::string& settings) {
  std::map<std::string, std::string> entries;
  std::string section;
  for (const TextLine& line : split_lines(settings)) {
    const std::string_view text = trimmed(line.text);
    if (text.size() > 2 && text.front() == '[' && text.back() == ']') {
      section = std::string(text.substr(1, text.size() - 2)) + ".";
      continue;
    }
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos) continue;
    std::string_view value = trimmed(text.substr(equals + 1));
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"')
      value = value.substr(1, value.size() - 2);
    entries[section + std::string(trimmed(text.substr(0, equals)))] = value;
  }
  return entries;
}

/// Samples of one channel on a line of pixels around a place.
struct Taps {
  std::array<int, 4> index{};
  std::array<double, 4> weight{};
};

/// at     from the middle of pixel 0
Taps taps_at(double at, int count) {
  const double floor = std::floor(at);
  const double t = at - floor;
  Taps taps;
  taps.weight = {0.5 * t * (-1.0 + t * (2.0 - t)), 1.0 + 0.5 * t * t * (-5.0 + 3.0 * t),
                 0.5 * t * (1.0 + t * (4.0 - 3.0 * t)), 0.5 * t * t * (-1.0 + t)};
  for (int k = 0; k < 4; ++k)
    taps.index[static_cast<std::size_t>(k)] =
        std::clamp(static_cast<int>(floor) - 1 + k, 0, count - 1);
  return taps;
}

/// Channel `k` of the result at p shows what stands at c + s (p - c).
void bring_back(const core::Image8& from, int k, double scale, const Eigen::Vector2d& center_px,
                core::Image8& to) {
  const auto taps_of = [&](int pixel, double center, int count) {
    return taps_at(center + scale * (pixel + 0.5 - center) - 0.5, count);
  };
  std::vector<Taps> columns;
  for (int x = 0; x < from.width(); ++x) columns.push_back(taps_of(x, center_px.x(), from.width()));
  for (int y = 0; y < from.height(); ++y) {
    const Taps row = taps_of(y, center_px.y(), from.height());
    for (int x = 0; x < from.width(); ++x) {
      const Taps& column = columns[static_cast<std::size_t>(x)];
      double sum = 0.0;
      for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t i = 0; i < 4; ++i)
          sum += row.weight[j] * column.weight[i] * from(column.index[i], row.index[j], k);
      to(x, y, k) = static_cast<std::uint8_t>(std::lround(std::clamp(sum, 0.0, 255.0)));
    }
  }
}

}  // namespace

Imaging imaging_of_settings(const std::string& settings, const std::string& where) {
  const std::map<std::string, std::string> entries = entries_of(settings);
  const auto scale_of = [&](const char* key) {
    constexpr double kMost_permille = 20.0;  // of the config
    const auto entry = entries.find(key);
    if (entry == entries.end()) return 1.0;
    const double permille = parse_number(entry->second, where);
    if (std::abs(permille) > kMost_permille)
      fail(ErrorKind::Input, "{}: {} = {}; it takes -{} to {}", where, key, permille,
           kMost_permille, kMost_permille);
    return 1.0 + 1e-3 * permille;
  };
  Imaging imaging;
  imaging.red_scale = scale_of("lens.red_scale_permille");
  imaging.blue_scale = scale_of("lens.blue_scale_permille");
  const auto word_of = [&](const char* key) {
    const auto entry = entries.find(key);
    return entry == entries.end() ? std::string() : entry->second;
  };
  const auto is_above_0 = [&](const char* key) {
    const std::string number = word_of(key);
    return !number.empty() && parse_number(number, where) > 0.0;
  };
  const std::string polynomial = word_of("lens.vignetting_polynomial");
  imaging.has_shading = is_above_0("lens.vignetting_exponent") || is_above_0("soiling.smudges") ||
                        is_above_0("soiling.dirt_spots") ||
                        (!polynomial.empty() && polynomial != "[]");
  if (const std::string mode = word_of("color.white_balance"); !mode.empty()) {
    imaging.white_balance = mode;
    if (mode == "temperature") imaging.white_balance += " " + word_of("color.temperature_k");
    if (mode == "gains") imaging.white_balance += " " + word_of("color.gains");
  }
  if (const std::string bits = word_of("sensor.bits"); !bits.empty())
    imaging.sensor_bits = static_cast<int>(std::clamp(parse_number(bits, where), 0.0, 16.0));
  return imaging;
}

void read_imaging(const Dataset& dataset, const std::string& path, Sequence& sequence,
                  Findings& findings) {
  if (!dataset.files.contains(path)) return;
  findings.attempt(path, [&] {
    const Json json = Json::parse(core::read_text_file(dataset.root / path), path);
    if (json.has("format") &&
        (json.at("format").string() != "terracast-imaging" || json.at("version").integer() != 1))
      fail(ErrorKind::Input, "{}: \"terracast-imaging\", version 1, are right", path);
    const Json& cameras = json.at("cameras");
    std::set<std::string> names;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const std::string name = cameras.at(i).at("name").string();
      const int camera = sequence.camera_index(name);
      if (camera < 0 || !names.insert(name).second)
        fail(ErrorKind::Input, "{}: there is no camera {}, or it stands twice", path,
             core::first_letters(name, 60));
      if (cameras.at(i).has("exposure_ev") &&
          std::ssize(cameras.at(i).at("exposure_ev").numbers()) != sequence.num_frames)
        fail(ErrorKind::Input, "{}: {} has other exposures than one a frame", path, name);
      if (cameras.at(i).has("settings"))
        sequence.cameras[static_cast<std::size_t>(camera)].imaging = imaging_of_settings(
            cameras.at(i).at("settings").string(), fmt::format("{}, {}", path, name));
    }
  });
}

core::Image8 without_aberration(const core::Image8& color, const Imaging& imaging,
                                const Eigen::Vector2d& center_px) {
  core::Image8 image = color;
  constexpr int kRed = 0, kBlue = 2;
  bring_back(color, kRed, imaging.red_scale, center_px, image);
  bring_back(color, kBlue, imaging.blue_scale, center_px, image);
  return image;
}

}  // namespace terracast::validate
