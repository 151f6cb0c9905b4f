#pragma once

#include <optional>
#include <string_view>

/// Values of tags as people write them: national signs, units, ranges and lists. One reading for all layers.
///
/// Numbers: a dot or a comma is the decimal sign. Of both the last is, and the others have to group digits by three
/// ("1.250,5", "1,250.5"); one sign that stands several times, blanks and apostrophes have to group by three, too. A
/// single comma before exactly three digits may be either ("1,250"): it is not understood. Three digits after an
/// apostrophe are a group ("1'250" is 1250), as no inches have three; fewer are inches ("12'6").
/// Several values, as a list ("2;3") or a range ("3-5"), are an Amount. Values without a unit have that of the next one
/// that has any ("10;12 ft", "220/110 kV"), and of a range that of its other end. What is uncertain ("~12", "ca. 12")
/// counts as it stands. Bounds and sums (">10", "10+", "2+1") are no values. Blanks at both ends, letters' case and typographic signs do not matter.
/// What is not read to its last sign is not understood: nullopt.
namespace terracast::tiler {

/// What a value says, from the least to the most of several.
struct Amount {
  double lowest = 0.0;
  double highest = 0.0;

  double middle() const { return 0.5 * (lowest + highest); }
  bool operator==(const Amount&) const = default;
};

/// m. Units: m (or none), mm, cm, dm, km, ft, in, yd, mi, nmi and their names; 40'6", 40 ft 6 in.
std::optional<Amount> length_from_tag(std::string_view text);
/// Of storeys, lanes and the like, which may be named ("4 levels"); also parts of one and below 0.
std::optional<Amount> count_from_tag(std::string_view text);
/// V. Units: V (or none), kV; values may be parted by "/", too. More than any line has is not understood.
std::optional<Amount> volts_from_tag(std::string_view text);
/// km/h. Units: km/h (or none), mph, knots.
std::optional<double> speed_kmph_from_tag(std::string_view text);
/// Of a slope, degrees from level, [0, 90). Units: degrees (or none), per cent.
std::optional<double> slope_deg_from_tag(std::string_view text);
/// Degrees clockwise from north, [0, 360): a number with or without a unit (from -720 to 720), one of the 16 points of
/// the compass as letters or words, or the middle of a sector from one number clockwise to another ("90-270").
std::optional<double> direction_deg_from_tag(std::string_view text);
/// yes, true, on, y, t, 1 and no, false, off, n, f, 0.
std::optional<bool> flag_from_tag(std::string_view text);

/// Whether a text is one of those that "|" parts.
bool is_one_of(std::string_view text, std::string_view choices);

}  // namespace terracast::tiler
