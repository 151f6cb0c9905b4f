#include "tiler/raster_claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

constexpr double kMetresPerUsFoot = 1200.0 / 3937.0;

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// Letters and digits alone: "EGM 2008 geoid" and "egm2008_geoid" are one.
std::string squeezed(const std::string& text) {
  std::string letters;
  for (const char c : lower(text))
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) letters += c;
  return letters;
}

/// What a declared vertical datum is, as far as configs state such.
enum class Datum { Unsaid, Ellipsoid, Egm96, Egm2008, SomeGeoid, Other };

Datum datum_of(const HeightClaims& claims) {
  if (claims.is_ellipsoidal) return Datum::Ellipsoid;
  const std::string name = squeezed(claims.datum);
  const auto has = [&](std::initializer_list<std::string_view> words) {
    return std::any_of(words.begin(), words.end(),
                       [&](std::string_view word) { return name.find(word) != std::string::npos; });
  };
  if (name.empty() || name == "unknown" || name == "unnamed" || name == "undefined")
    return Datum::Unsaid;
  if (has({"ellipsoid", "esri115700"}) || name == "wgs1984" || name == "wgs84")
    return Datum::Ellipsoid;
  if (has({"egm96", "egm1996", "epsg5773"}) || name == "e96") return Datum::Egm96;
  if (has({"egm2008", "egm08", "epsg3855"}) || name == "e08") return Datum::Egm2008;
  // Some sea level or geoid, without saying which: EPSG:5714 and DTED's MSL.
  if (has({"epsg5714"}) || name == "msl" || name == "mslheight" || name == "meansealevel" ||
      name == "geoid" || name == "orthometricheight")
    return Datum::SomeGeoid;
  return Datum::Other;
}

bool agrees(Datum declared, const std::string& stated) {
  if (declared == Datum::Unsaid || stated.empty()) return true;
  if (stated == "grid") return declared != Datum::Ellipsoid;
  if (stated == "ellipsoid") return declared == Datum::Ellipsoid;
  return declared == Datum::SomeGeoid ||
         declared == (stated == "egm96" ? Datum::Egm96 : Datum::Egm2008);
}

std::string_view way_out(Datum declared) {
  switch (declared) {
    case Datum::Ellipsoid:
      return "state vertical_datum = \"ellipsoid\"";
    case Datum::Egm96:
      return "state vertical_datum = \"egm96\"";
    case Datum::Egm2008:
      return "state vertical_datum = \"egm2008\"";
    default:
      return "state vertical_datum = \"grid\" with the grid of its geoid as datum_grid";
  }
}

double metres_of_option(const std::string& unit) {
  if (unit == "ft") return geo::metres_from_feet(1.0);
  return unit == "us_ft" ? kMetresPerUsFoot : 1.0;
}

/// Units are stated with ten digits and more; the two feet differ by 2e-6.
bool is_same(double one_m, double other_m) { return std::abs(one_m / other_m - 1.0) < 1e-8; }

}  // namespace

std::optional<double> metres_in(std::string unit) {
  struct Unit {
    double metres;
    std::initializer_list<std::string_view> words;
  };
  static const std::array kUnits = {
      Unit{1.0, {"", "m", "metre", "metres", "meter", "meters", "metre(s)", "meter(s)"}},
      Unit{0.1, {"dm", "decimetre", "decimetres", "decimeter", "decimeters"}},
      Unit{0.01, {"cm", "centimetre", "centimetres", "centimeter", "centimeters"}},
      Unit{0.001, {"mm", "millimetre", "millimetres", "millimeter", "millimeters"}},
      Unit{1000.0, {"km", "kilometre", "kilometres", "kilometer", "kilometers"}},
      Unit{geo::metres_from_feet(1.0),
           {"ft", "foot", "feet", "ift", "foot_intl", "foot (international)", "international foot",
            "international feet", "intl foot"}},
      Unit{kMetresPerUsFoot,
           {"us-ft", "us_ft", "usft", "ftus", "sft", "us survey foot", "us survey feet", "foot_us",
            "survey foot", "us foot", "foot us", "u.s. foot", "u.s. survey foot",
            "us survey foot (us survey foot)"}},
  };
  unit = lower(std::move(unit));
  while (unit.ends_with(' ')) unit.pop_back();
  for (const Unit& one : kUnits)
    for (const std::string_view word : one.words)
      if (unit == word) return one.metres;
  return std::nullopt;
}

HeightClaims height_claims(GDALDataset& dataset, GDALRasterBand& band, const HorizontalCrs& crs) {
  HeightClaims claims{.band_unit = band.GetUnitType() == nullptr ? "" : band.GetUnitType(),
                      .crs_unit = crs.vertical_unit,
                      .datum = crs.vertical_name,
                      .is_ellipsoidal = crs.is_3d};
  const char* dted = dataset.GetMetadataItem("DTED_VerticalDatum");
  if (claims.datum.empty() && dted != nullptr) claims.datum = dted;
  return claims;
}

double metres_per_unit(const HeightClaims& claims, const ElevationOptions& options,
                       const std::string& written) {
  const bool is_stated = options.unit != "declared";
  const double stated_m = metres_of_option(options.unit);
  if (is_stated && options.trust == "config") return stated_m;
  std::optional<double> declared_m;
  std::string declared;
  for (const std::string& word : {claims.band_unit, claims.crs_unit}) {
    if (word.empty()) continue;
    const auto metres = metres_in(word);
    if (!metres && is_stated) continue;
    if (!metres)
      fail(ErrorKind::Input,
           "{}: declares heights in \"{}\", which is no known unit of length; state unit = \"m\", "
           "\"ft\" or \"us_ft\"",
           written, word);
    if (declared_m && !is_same(*metres, *declared_m))
      fail(ErrorKind::Input,
           "{}: its band declares heights in \"{}\", and its vertical reference system in \"{}\"; "
           "state unit and trust = \"config\"",
           written, declared, word);
    declared_m = metres;
    declared = word;
  }
  if (!is_stated) return declared_m.value_or(1.0);
  if (declared_m && !is_same(*declared_m, stated_m))
    fail(ErrorKind::Input,
         "{}: declares heights in \"{}\", and unit = \"{}\" is stated; leave unit out if the file "
         "is right, or state trust = \"config\" if it is wrong",
         written, declared, options.unit);
  return stated_m;
}

void check_vertical_datum(const HeightClaims& claims, const ElevationOptions& options,
                          const std::string& written) {
  if (options.trust == "config") return;
  const Datum declared = datum_of(claims);
  if (agrees(declared, options.vertical_datum)) return;
  const std::string name =
      claims.is_ellipsoidal ? "the ellipsoid (a reference system of three axes)" : claims.datum;
  fail(ErrorKind::Input,
       "{}: declares its heights above \"{}\", and vertical_datum = \"{}\" is stated; {} if the "
       "file is right, or trust = \"config\" if it is wrong",
       written, name, options.vertical_datum, way_out(declared));
}

}  // namespace terracast::tiler
