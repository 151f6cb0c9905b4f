#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace terracast::validate {

/// Damage that was met while a dataset was read: which file, and what about it. Findings make the
/// check `structure` fail; they never end the run.
/// threads  add() is safe; the list is sorted when asked for, so that it does not depend on the
///          order of the threads
class Findings {
 public:
  void add(const std::string& file, const std::string& what);

  /// Runs `work`; whatever it throws becomes a finding about `file`, but for Interrupted.
  /// returns  whether it ended without one
  bool attempt(const std::string& file, const std::function<void()>& work);

  std::int64_t count() const;
  /// The first of them, sorted by file: at most `most`, as "file: what", each core::printable().
  std::vector<std::string> lines(std::size_t most = 40) const;

 private:
  mutable std::mutex mutex_;
  std::int64_t count_ = 0;
  std::vector<std::string> lines_;
};

}  // namespace terracast::validate
