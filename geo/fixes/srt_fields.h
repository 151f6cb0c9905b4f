#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/ledger.h"

namespace terracast::geo {

/// A field of a subtitle: "latitude" = "31.45", "gps" = "-58.85, -34.23, 15".
struct SrtField {
  std::string name;  ///< in lower case; of "longtitude" too as it stands
  std::string value;
};

inline constexpr const char* kSrtDate = "date and time";

/// What the reader of subtitles makes of fields.
std::span<const core::KnownName> known_srt_fields();

/// A subtitle's text without tags (<font …>, {\an8}), line ends also where a text has \N for them.
std::string srt_text(std::string_view lines);

/// The fields of a subtitle in all the wordings that aircraft write: [name : value], [a: 1 b: 2], NAME(values),
/// NAME (values), NAME:value, NAME value and F/2.8. Words without a value have an empty one.
/// A date and time of day that stands by itself is the field kSrtDate, which no field of a file is called.
std::vector<SrtField> srt_fields(std::string_view text);

/// The number at the front of a text, without what follows ("-57.98m", "2.7 deg").
std::optional<double> leading_number(std::string_view text);

}  // namespace terracast::geo
