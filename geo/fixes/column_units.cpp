#include "geo/fixes/column_units.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

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
    Unit{Quantity::Attitude, "deg", 1.0},
    Unit{Quantity::Attitude, "rad", degrees_from_radians(1.0)},
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
    Word{Quantity::Length, "m", "m"},
    Word{Quantity::Length, "meter", "m"},
    Word{Quantity::Length, "meters", "m"},
    Word{Quantity::Length, "metre", "m"},
    Word{Quantity::Length, "metres", "m"},
    Word{Quantity::Length, "ft", "ft"},
    Word{Quantity::Length, "foot", "ft"},
    Word{Quantity::Length, "feet", "ft"},
    Word{Quantity::Length, "km", "km"},
    Word{Quantity::Length, "cm", "cm"},
    Word{Quantity::Length, "mm", "mm"},
    Word{Quantity::Angle, "deg", "deg"},
    Word{Quantity::Angle, "degs", "deg"},
    Word{Quantity::Angle, "degree", "deg"},
    Word{Quantity::Angle, "degrees", "deg"},
    Word{Quantity::Angle, "\u00B0", "deg"},
    Word{Quantity::Angle, "rad", "rad"},
    Word{Quantity::Angle, "rads", "rad"},
    Word{Quantity::Angle, "radian", "rad"},
    Word{Quantity::Angle, "radians", "rad"},
    Word{Quantity::Angle, "1e7", "deg_e7"},
    Word{Quantity::Angle, "e7", "deg_e7"},
    Word{Quantity::Angle, "dege7", "deg_e7"},
    Word{Quantity::Speed, "mps", "mps"},
    Word{Quantity::Speed, "m/s", "mps"},
    Word{Quantity::Speed, "ms-1", "mps"},
    Word{Quantity::Speed, "m s-1", "mps"},
    Word{Quantity::Speed, "m.s-1", "mps"},
    Word{Quantity::Speed, "kmph", "kmh"},
    Word{Quantity::Speed, "km/hr", "kmh"},
    Word{Quantity::Speed, "km h-1", "kmh"},
    Word{Quantity::Speed, "mi/hr", "mph"},
    Word{Quantity::Speed, "kn", "kn"},
    Word{Quantity::Speed, "kt", "kn"},
    Word{Quantity::Speed, "kts", "kn"},
    Word{Quantity::Speed, "knot", "kn"},
    Word{Quantity::Speed, "knots", "kn"},
    Word{Quantity::Speed, "kmh", "kmh"},
    Word{Quantity::Speed, "km/h", "kmh"},
    Word{Quantity::Speed, "kph", "kmh"},
    Word{Quantity::Speed, "mph", "mph"},
    Word{Quantity::Speed, "mi/h", "mph"},
    Word{Quantity::Time, "s", "s"},
    Word{Quantity::Time, "sec", "s"},
    Word{Quantity::Time, "secs", "s"},
    Word{Quantity::Time, "second", "s"},
    Word{Quantity::Time, "seconds", "s"},
    Word{Quantity::Time, "ms", "ms"},
    Word{Quantity::Time, "msec", "ms"},
    Word{Quantity::Time, "millis", "ms"},
    Word{Quantity::Time, "millisecond", "ms"},
    Word{Quantity::Time, "milliseconds", "ms"},
    Word{Quantity::Time, "us", "us"},
    Word{Quantity::Time, "\u00B5s", "us"},
    Word{Quantity::Time, "\u03BCs", "us"},
    Word{Quantity::Time, "usec", "us"},
    Word{Quantity::Time, "micros", "us"},
    Word{Quantity::Time, "microsecond", "us"},
    Word{Quantity::Time, "microseconds", "us"},
    Word{Quantity::Time, "ns", "ns"},
    Word{Quantity::Time, "nsec", "ns"},
    Word{Quantity::Time, "nanos", "ns"},
    Word{Quantity::Time, "nanosecond", "ns"},
    Word{Quantity::Time, "nanoseconds", "ns"},
};

/// Units that no key has: what is in them is not silently taken for something else.
constexpr std::array kOthers = {
    Word{Quantity::Length, "dm", ""},  Word{Quantity::Length, "mi", ""},
    Word{Quantity::Length, "nmi", ""}, Word{Quantity::Length, "yd", ""},
    Word{Quantity::Angle, "cdeg", ""}, Word{Quantity::Angle, "mrad", ""},
    Word{Quantity::Angle, "grad", ""}, Word{Quantity::Angle, "gon", ""},
    Word{Quantity::Angle, "mil", ""},  Word{Quantity::Speed, "fps", ""},
    Word{Quantity::Speed, "ft/s", ""}, Word{Quantity::Speed, "cm/s", ""},
    Word{Quantity::Speed, "mm/s", ""}, Word{Quantity::Speed, "ft/min", ""}};

const Word* find_word(Quantity quantity, std::string_view text) {
  const Quantity of = quantity == Quantity::Attitude ? Quantity::Angle : quantity;
  for (const std::span<const Word> words :
       {std::span<const Word>(kWords), std::span<const Word>(kOthers)})
    for (const Word& known : words)
      if (known.quantity == of && known.word == text &&
          (quantity != Quantity::Attitude || known.unit != "deg_e7"))
        return &known;
  return nullptr;
}

/// Words of a name, each with the next one as "m/s" too: names of columns have few signs.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words(1);
  for (const char c : name)
    if (std::string_view("_ ()[].-").find(c) == std::string_view::npos)
      words.back() += c;
    else if (!words.back().empty())
      words.emplace_back();
  if (words.back().empty()) words.pop_back();
  for (std::size_t i = words.size(); i-- > 2;) words.push_back(words[i - 1] + "/" + words[i]);
  return words;
}

/// What stands in the last brackets of a name; empty: there are none.
std::string_view in_brackets(std::string_view name) {
  const std::size_t end = name.find_last_of("])");
  const std::size_t begin = name.find_last_of("[(", end);
  if (end == std::string_view::npos || begin == std::string_view::npos) return "";
  std::string_view content = name.substr(begin + 1, end - begin - 1);
  while (content.ends_with('.') || content.ends_with(' ')) content.remove_suffix(1);
  return content;
}

/// The unit that a name in small letters states: in its brackets, or as the one unit among its words behind the first.
/// nullptr: none, or several.
const Word* stated_unit(Quantity quantity, std::string_view name) {
  if (quantity == Quantity::Angle && name.find("1e-7") != std::string_view::npos)
    return find_word(quantity, "e7");
  if (const Word* whole = find_word(quantity, in_brackets(name))) return whole;
  const std::vector<std::string> words = words_of(name);
  const Word* found = nullptr;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const Word* one = find_word(quantity, words[i]);
    if (one == nullptr) continue;
    if (found != nullptr && found->unit != one->unit) return nullptr;
    found = one;
  }
  return found;
}

/// Of a column that nothing says more of.
std::string usual_unit(Quantity quantity) {
  return std::string(std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& unit) {
                       return unit.quantity == quantity;
                     })->name);
}

}  // namespace

std::string unit_of_name(Quantity quantity, std::string_view column) {
  const Word* word = stated_unit(quantity, in_lower_case(column));
  return word == nullptr ? "" : std::string(word->unit);
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
  else if (const Word* word = stated_unit(quantity, in_lower_case(column));
           stated.empty() && word != nullptr && word->unit.empty())
    remark = fmt::format("{} is read as {} = \"{}\", while its name says {}, which no key states",
                         column, key, unit, word->word);
  else if (stated.empty() && unit != usual)
    remark = fmt::format("{} is read as {} = \"{}\", as its name says", column, key, unit);
}

}  // namespace terracast::geo
