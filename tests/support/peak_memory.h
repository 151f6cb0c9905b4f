#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <string>

namespace terracast::test {

/// The most memory that this process holds from here on, beside what it holds now: Linux's VmHWM, begun anew. The
/// address sanitizer keeps what is freed: under it nothing is measured, and there is no more (0 MB).
class PeakMemory {
 public:
  PeakMemory() {
    std::ofstream restart("/proc/self/clear_refs");
    restart << 5 << std::flush;
    is_told_ = restart.good();
    before_mb_ = peak_mb();
  }
  double more_mb() const {
#ifdef __SANITIZE_ADDRESS__
    return 0.0;
#else
    EXPECT_TRUE(is_told_ && before_mb_ > 0.0)
        << "the system does not tell how much memory there was at most";
    return peak_mb() - before_mb_;
#endif
  }

 private:
  static double peak_mb() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024.0;
    return 0.0;
  }

  bool is_told_ = false;
  double before_mb_ = 0.0;
};

}  // namespace terracast::test
