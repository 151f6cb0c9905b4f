#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "capture/stream.h"

namespace terracast::exporters {

/// Finds the columns of a stream's samples by the names of their channels.
class StreamColumns {
 public:
  /// stream   must outlive this
  explicit StreamColumns(const capture::StreamInfo& stream) : stream_(stream) {}

  /// throws   Input: the sensor has no such channel
  std::size_t at(std::string_view name) const;
  /// The columns START + axis + END, one for each letter of `axes`.
  std::vector<std::size_t> of_axes(const std::string& start, std::string_view axes,
                                   const std::string& end) const;

 private:
  const capture::StreamInfo& stream_;
};

/// A number of a sensor's resolved settings.
/// section   that holds the key; empty: the key stands at the top
/// throws    Input: there is no such key
double number_of_settings(const capture::StreamInfo& stream, std::string_view section,
                          std::string_view key);

/// A name among them, which stands at the top: of letters, digits, _ and -, or empty.
/// throws    as number_of_settings()
std::string text_of_settings(const capture::StreamInfo& stream, std::string_view key);

}  // namespace terracast::exporters
