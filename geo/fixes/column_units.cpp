#include "geo/fixes/column_units.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/error.h"
#include "geo/fixes/text.h"
#include "geo/fixes/units.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

struct Unit {
  Quantity quantity;
  std::string_view name;  ///< as the config calls it
  double si;
};
/// The usual one of each quantity first.
const std::array kUnits = {
    Unit{Quantity::Length, "m", 1.0},
    Unit{Quantity::Length, "ft", metres_from_feet(1.0)},
    Unit{Quantity::Length, "km", 1e3},
    Unit{Quantity::Length, "cm", 1e-2},
    Unit{Quantity::Length, "mm", 1e-3},
    Unit{Quantity::Angle, "deg", 1.0},
    Unit{Quantity::Angle, "rad", degrees_from_radians(1.0)},
    Unit{Quantity::Angle, "deg_e7", 1e-7},
    Unit{Quantity::Speed, "mps", 1.0},
    Unit{Quantity::Speed, "kn", kMetresPerSecondPerKnot},
    Unit{Quantity::Speed, "kmh", 1.0 / 3.6},
    Unit{Quantity::Speed, "mph", kMetresPerSecondPerMileAnHour},
    Unit{Quantity::Time, "s", 1.0},
    Unit{Quantity::Time, "ms", 1e-3},
    Unit{Quantity::Time, "us", 1e-6},
    Unit{Quantity::Time, "ns", 1e-9},
};

/// What writers call it.
struct Word {
  Quantity quantity;
  std::string_view word, unit;
};
constexpr std::array kWords = {
    Word{Quantity::Length, "m", "m"},           Word{Quantity::Length, "meter", "m"},
    Word{Quantity::Length, "meters", "m"},      Word{Quantity::Length, "metre", "m"},
    Word{Quantity::Length, "metres", "m"},      Word{Quantity::Length, "ft", "ft"},
    Word{Quantity::Length, "foot", "ft"},       Word{Quantity::Length, "feet", "ft"},
    Word{Quantity::Length, "km", "km"},         Word{Quantity::Length, "cm", "cm"},
    Word{Quantity::Length, "mm", "mm"},         Word{Quantity::Angle, "deg", "deg"},
    Word{Quantity::Angle, "degs", "deg"},       Word{Quantity::Angle, "degree", "deg"},
    Word{Quantity::Angle, "degrees", "deg"},    Word{Quantity::Angle, "\u00B0", "deg"},
    Word{Quantity::Angle, "rad", "rad"},        Word{Quantity::Angle, "rads", "rad"},
    Word{Quantity::Angle, "radian", "rad"},     Word{Quantity::Angle, "radians", "rad"},
    Word{Quantity::Angle, "1e7", "deg_e7"},     Word{Quantity::Angle, "e7", "deg_e7"},
    Word{Quantity::Speed, "mps", "mps"},        Word{Quantity::Speed, "m/s", "mps"},
    Word{Quantity::Speed, "ms-1", "mps"},       Word{Quantity::Speed, "kn", "kn"},
    Word{Quantity::Speed, "kt", "kn"},          Word{Quantity::Speed, "kts", "kn"},
    Word{Quantity::Speed, "knot", "kn"},        Word{Quantity::Speed, "knots", "kn"},
    Word{Quantity::Speed, "kmh", "kmh"},        Word{Quantity::Speed, "km/h", "kmh"},
    Word{Quantity::Speed, "kph", "kmh"},        Word{Quantity::Speed, "mph", "mph"},
    Word{Quantity::Speed, "mi/h", "mph"},       Word{Quantity::Time, "s", "s"},
    Word{Quantity::Time, "sec", "s"},           Word{Quantity::Time, "secs", "s"},
    Word{Quantity::Time, "second", "s"},        Word{Quantity::Time, "seconds", "s"},
    Word{Quantity::Time, "ms", "ms"},           Word{Quantity::Time, "msec", "ms"},
    Word{Quantity::Time, "millis", "ms"},       Word{Quantity::Time, "millisecond", "ms"},
    Word{Quantity::Time, "milliseconds", "ms"}, Word{Quantity::Time, "us", "us"},
    Word{Quantity::Time, "\u00B5s", "us"},      Word{Quantity::Time, "\u03BCs", "us"},
    Word{Quantity::Time, "usec", "us"},         Word{Quantity::Time, "micros", "us"},
    Word{Quantity::Time, "microsecond", "us"},  Word{Quantity::Time, "microseconds", "us"},
    Word{Quantity::Time, "ns", "ns"},           Word{Quantity::Time, "nsec", "ns"},
    Word{Quantity::Time, "nanos", "ns"},        Word{Quantity::Time, "nanosecond", "ns"},
    Word{Quantity::Time, "nanoseconds", "ns"},
};

/// What stands in the last brackets of a name, or behind its last sign; empty: it is one word.
std::string_view last_word(std::string_view name) {
  while (!name.empty() && (name.back() == ']' || name.back() == ')' || name.back() == ' '))
    name.remove_suffix(1);
  const std::size_t begin = name.find_last_of("_ [(-.");
  if (begin == std::string_view::npos) return "";
  return name.substr(begin + 1);
}

/// Of a column that nothing says more of.
std::string usual_unit(Quantity quantity) {
  return std::string(std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& unit) {
                       return unit.quantity == quantity;
                     })->name);
}

}  // namespace

std::string unit_of_name(Quantity quantity, std::string_view column) {
  const std::string lower = in_lower_case(column);
  std::string_view word = last_word(lower);
  // "m s-1" and "ms-1" end behind a dash of their own.
  if (quantity == Quantity::Speed && (lower.find("ms-1") != std::string::npos)) word = "ms-1";
  for (const Word& known : kWords)
    if (known.quantity == quantity && known.word == word) return std::string(known.unit);
  return "";
}

double si_per(Quantity quantity, std::string_view unit) {
  if (quantity == Quantity::Time && unit.starts_with("unix_")) unit.remove_prefix(5);
  for (const Unit& known : kUnits)
    if (known.quantity == quantity && known.name == unit) return known.si;
  TERRACAST_CHECK(false, "unit {} is none of the quantity", unit);
  return 1.0;
}

ColumnUnit::ColumnUnit(Quantity quantity, std::string_view column, std::string_view key,
                       std::string_view stated) {
  const std::string named = unit_of_name(quantity, column);
  const std::string usual = usual_unit(quantity);
  const std::string unit = !stated.empty() ? std::string(stated) : !named.empty() ? named : usual;
  si = si_per(quantity, unit);
  if (!stated.empty() && !named.empty() && si != si_per(quantity, named))
    remark =
        fmt::format("{} is read as {} = \"{}\", while its name says {}", column, key, unit, named);
  else if (stated.empty() && unit != usual)
    remark = fmt::format("{} is read as {} = \"{}\", as its name says", column, key, unit);
}

}  // namespace terracast::geo
