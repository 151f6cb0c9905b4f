#include <array>

#include "geo/fixes/fix_format.h"

// Every format of recordings, in alphabetical order: X(name) is geo/fixes/name.cpp, which defines
// `FixFormatInfo name_fixes()`.
#define TERRACAST_FIX_FORMATS(X) \
  X(adsb) X(csv) X(euroc) X(gpx) X(jsbsim) X(oxts) X(sbet) X(srt) X(tum) X(ulog)

namespace terracast::geo {

#define TERRACAST_DECLARE(name) FixFormatInfo name##_fixes();
TERRACAST_FIX_FORMATS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const FixFormatInfo> fix_formats() {
#define TERRACAST_ENTRY(name) name##_fixes(),
  static const std::array table = {TERRACAST_FIX_FORMATS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

}  // namespace terracast::geo
