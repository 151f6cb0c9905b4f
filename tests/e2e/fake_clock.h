#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace terracast::test {

/// What libfaketime tells a process of the time.
class FakeClock {
 public:
  FakeClock();
  bool is_there() const { return !library_.empty(); }

  using Environment = std::vector<std::pair<std::string, std::string>>;
  /// offset         "+2d"
  /// with_steady    the clock that never jumps, too; leases are renewed no more under it, since
  ///                libfaketime leaves what waits by it alone
  Environment shifted(const std::string& offset, bool with_steady) const;
  /// By what a file says at the time.
  Environment by_file(const std::filesystem::path& file) const;

 private:
  std::string library_;
};

}  // namespace terracast::test
