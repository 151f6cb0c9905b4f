#include "tiler/no_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "tiler/world_options.h"

namespace terracast::tiler {
namespace {

constexpr double kLargestFloat = 3.4028234663852886e38;

/// None of them is a height in metres or feet on Earth but -9999, which the deepest trenches reach.
constexpr std::array kFills = {
    CustomaryFill{-9999.0, "marks voids in many grids of text, and by habit elsewhere"},
    CustomaryFill{-99999.0, "marks voids in many grids of text"},
    CustomaryFill{-999999.0, "marks voids in many grids of lidar"},
    CustomaryFill{-32768.0, "marks voids of SRTM, and is the least 16-bit number"},
    CustomaryFill{-32767.0, "marks voids of DTED and USGS models"},
    CustomaryFill{32767.0, "is the largest 16-bit number"},
    CustomaryFill{65535.0, "is the largest 16-bit number without a sign"},
    CustomaryFill{-2147483648.0, "is the least 32-bit number"},
    CustomaryFill{2147483647.0, "is the largest 32-bit number"},
    CustomaryFill{1e20, "marks voids of climate models"},
    CustomaryFill{9.96920996838687e36, "is netCDF's fill value"},
    CustomaryFill{1.70141e38, "marks voids of Surfer's grids"},
    CustomaryFill{-kLargestFloat, "is the least float, which ArcGIS marks voids with"},
    CustomaryFill{kLargestFloat, "is the largest float"},
};

/// Values are printed with six digits or more.
bool is_near(double value, double fill) {
  return value == fill || (std::abs(fill) > 1e9 && std::abs(value / fill - 1.0) < 1e-5);
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

}  // namespace

std::optional<NoData> NoData::from_text(std::string_view text) {
  NoData no_data;
  if (trimmed(text) == "none") {
    no_data.takes_masks_ = false;
    return no_data;
  }
  while (true) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string word(trimmed(text.substr(0, comma)));
    if (word == "declared")
      no_data.takes_declared_ = true;
    else if (const auto value = number_from_text(word))
      no_data.values_.push_back(*value);
    else
      return std::nullopt;
    if (comma == text.size()) return no_data;
    text.remove_prefix(comma + 1);
  }
}

NoData NoData::of(std::string_view text) {
  const std::optional<NoData> no_data = from_text(text);
  TERRACAST_CHECK(no_data.has_value(), "nodata = \"{}\" was not looked at", text);
  return *no_data;
}

void NoData::take_declared(GDALRasterBand& band) {
  if (!takes_declared_) return;
  int has_value = FALSE;
  const double value = band.GetNoDataValue(&has_value);
  if (has_value != FALSE) values_.push_back(value);
}

bool NoData::holds(double value, GDALDataType type) const {
  constexpr double kLargestFloat = std::numeric_limits<float>::max();
  if (std::isnan(value)) return true;
  return std::any_of(values_.begin(), values_.end(), [&](double one) {
    // A value such as -3.4028234663852886e+38 is declared with more digits than a float holds.
    return value == one || (type == GDT_Float32 && std::abs(one) <= kLargestFloat &&
                            static_cast<float>(value) == static_cast<float>(one));
  });
}

std::string NoData::text() const {
  if (values_.empty()) return takes_masks_ ? "declared" : "none";
  std::string text;
  for (const double value : values_)
    text += fmt::format("{}{:.17g}", text.empty() ? "" : ", ", value);
  return text;
}

std::string NoData::text_with(double value) const {
  return values_.empty() && !takes_declared_ ? fmt::format("{:.17g}", value)
                                             : fmt::format("{}, {:.17g}", text(), value);
}

std::span<const CustomaryFill> customary_fills() { return kFills; }

const CustomaryFill* customary_fill(double value) {
  const auto found = std::find_if(kFills.begin(), kFills.end(), [&](const CustomaryFill& fill) {
    return is_near(value, fill.value);
  });
  return found == kFills.end() ? nullptr : &*found;
}

}  // namespace terracast::tiler
