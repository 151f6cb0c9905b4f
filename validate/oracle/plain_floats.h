#pragma once

#include <cfenv>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace terracast::oracle {

/// Rounding to nearest with denormals kept, for as long as it lives. Exact predicates give wrong signs
/// where a ray tracer's mode (denormals are 0) has been left switched on.
class PlainFloats {
 public:
  PlainFloats() {
    std::fegetenv(&before_);
    std::fesetenv(FE_DFL_ENV);
#if defined(__SSE__)
    // The C library's default environment is the same; it says nothing of denormals, though.
    constexpr unsigned kDefaultMode = 0x1f80;
    _mm_setcsr(kDefaultMode);
#endif
  }
  ~PlainFloats() { std::fesetenv(&before_); }
  PlainFloats(const PlainFloats&) = delete;
  PlainFloats& operator=(const PlainFloats&) = delete;

 private:
  std::fenv_t before_;
};

}  // namespace terracast::oracle
