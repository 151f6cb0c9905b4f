#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/cloned.h"
#include "core/registry.h"
#include "core/schema.h"
#include "core/schema_writer.h"

namespace terracast::core {

/// One of several kinds that a config names, with the kind's own keys beside it. Copies are deep.
///
/// Info is a row of a registry's table: `name`, and `make`, which returns a std::unique_ptr of the kind's options with
/// describe(), clone() and, where keys depend on each other, validate().
template <class Info>
class Choice {
 public:
  using Options = typename decltype(std::declval<const Info&>().make())::element_type;

  const std::string& kind() const { return kind_; }
  bool is_made() const { return static_cast<bool>(options_); }
  /// Once describe() was called with a kind.
  const Options& operator*() const { return *options_; }
  const Options* operator->() const { return &*options_; }

  void set(std::string kind, std::unique_ptr<Options> options) {
    kind_ = std::move(kind);
    options_ = std::move(options);
  }

  /// Describes the key that names the kind, which is required, and the keys of that kind.
  /// what      in messages: "sensor"
  void describe(SchemaVisitor& visit, std::string_view key, std::string_view what,
                std::string_view meaning, std::span<const Info> table) {
    const std::string before = kind_;
    visit.key(key, kind_, meaning, required(one_of(registry_names(table))));
    if (kind_.empty()) return;  // a list of keys without a config
    if (!options_ || kind_ != before) options_ = find_registered(table, what, kind_).make();
    options_->describe(visit);
  }

  /// The kind's own keys as TOML, every one.
  std::string settings_toml() const {
    struct Settings {
      Cloned<Options> options;
      void describe(SchemaVisitor& visit) { options->describe(visit); }
    };
    return toml_text(Settings{options_});
  }

  void validate() const {
    if constexpr (requires(const Options& options) { options.validate(); })
      if (options_) options_->validate();
  }

 private:
  std::string kind_;
  Cloned<Options> options_;
};

}  // namespace terracast::core
