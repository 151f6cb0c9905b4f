#pragma once

#include <gdal_priv.h>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::tiler {

/// Which of a raster's stored samples are no values. NaN never is one, whatever a file or a config says.
///
/// Written in configs as `declared` (what the file declares, with its masks), `none`, or numbers with commas between
/// them, of which one may be the word declared: "-9999, -32768", "declared, 0". Numbers leave masks as they are, `none` leaves out
/// the file's value and its masks.
class NoData {
 public:
  /// Nothing for text that is none of the above.
  static std::optional<NoData> from_text(std::string_view text);
  /// The same for text that was looked at before.
  static NoData of(std::string_view text);

  bool takes_declared() const { return takes_declared_; }
  bool takes_masks() const { return takes_masks_; }
  /// With the value that a band declares, when that counts.
  void take_declared(GDALRasterBand& band);

  /// value   as it is stored, as a double
  /// type    of the samples: a float's values are declared with more digits than it holds
  bool holds(double value, GDALDataType type) const;
  const std::vector<double>& values() const { return values_; }
  /// As from_text() takes it, with what the file declares.
  std::string text() const;
  /// As a config is to be written so that another value counts, too.
  std::string text_with(double value) const;

 private:
  std::vector<double> values_;
  bool takes_declared_ = false;
  bool takes_masks_ = true;
};

/// For messages on configs: what from_text() takes.
inline constexpr std::string_view kNoDataWords =
    "declared, none, or numbers such as \"-32768\" or \"-9999, -32768\"";

/// A value that other programs write where there is none.
struct CustomaryFill {
  double value;
  std::string_view where;  ///< for messages: who writes it
};
std::span<const CustomaryFill> customary_fills();
/// The fill that a stored sample is, to a float's digits; nullptr: none.
const CustomaryFill* customary_fill(double value);

}  // namespace terracast::tiler
