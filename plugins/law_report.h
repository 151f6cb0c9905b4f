#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::plugins {

/// A law that was tried.
struct LawTried {
  std::string law;     ///< in words that follow on a kind's name: "keeps its bytes on two threads"
  std::string broken;  ///< the first thing that was found wrong; empty: it holds
};

/// Takes down what laws find. Threads: one.
class LawReport {
 public:
  /// told   of each law when it begins, and of what is found wrong with it, at once: the
  ///        listener then knows which law hung or crashed
  explicit LawReport(std::function<void(const LawTried&)> told = {}) : told_(std::move(told)) {}

  void begin(std::string_view law);
  /// The law that was begun is broken. Of what is found wrong with a law the first is kept.
  void broken(std::string what);
  void expect(bool holds, const std::string& what) {
    if (!holds) broken(what);
  }
  /// Whether the law that was begun still holds: loops end with it.
  bool holds() const { return laws_.empty() || laws_.back().broken.empty(); }

  std::span<const LawTried> laws() const { return laws_; }
  bool all_hold() const;
  /// The broken laws, "LAW: WHAT", a line each.
  std::string text() const;

 private:
  std::function<void(const LawTried&)> told_;
  std::vector<LawTried> laws_;
};

}  // namespace terracast::plugins
