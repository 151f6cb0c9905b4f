#pragma once

namespace terracast::geo {

/// Up to which derivative a curve made of pieces is continuous.
enum class Continuity { Second, Fourth };

}  // namespace terracast::geo
