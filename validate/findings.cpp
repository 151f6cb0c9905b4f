#include "validate/findings.h"

#include <algorithm>
#include <exception>

#include "core/error.h"
#include "core/printable.h"

namespace terracast::validate {

void Findings::add(const std::string& file, const std::string& what) {
  constexpr std::size_t kMostKept =
      20000;  // a hostile dataset must not fill the memory with complaints
  const std::lock_guard lock(mutex_);
  ++count_;
  if (lines_.size() < kMostKept)
    lines_.push_back(core::printable(what.starts_with(file) ? what : file + ": " + what));
}

bool Findings::attempt(const std::string& file, const std::function<void()>& work) {
  try {
    work();
    return true;
  } catch (const core::Error& error) {
    if (error.kind() == core::ErrorKind::Interrupted) throw;
    add(file, error.message());
  } catch (const std::exception& error) {
    add(file, error.what());
  }
  return false;
}

std::int64_t Findings::count() const {
  const std::lock_guard lock(mutex_);
  return count_;
}

std::vector<std::string> Findings::lines(std::size_t most) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> sorted = lines_;
  std::sort(sorted.begin(), sorted.end());
  if (sorted.size() > most) sorted.resize(most);
  return sorted;
}

}  // namespace terracast::validate
