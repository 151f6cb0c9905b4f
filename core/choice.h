#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/plugin_rows.h"
#include "core/registry.h"
#include "core/schema.h"
#include "core/schema_writer.h"

namespace terracast::core {

/// The options of one kind of several, made with their defaults when another kind is described than before. Copies are
/// deep.
///
/// Info is a row of a registry's table: `name`, and `make`, which returns a std::unique_ptr of the kind's options with
/// describe(), clone() and, where keys depend on each other, validate().
template <class Info>
class KindOptions {
 public:
  using Options = typename decltype(std::declval<const Info&>().make())::element_type;

  KindOptions() = default;
  /// throws   Internal: clone() of the options returned nothing
  KindOptions(const KindOptions& other)
      : kind_(other.kind_), options_(other.options_ ? other.options_->clone() : nullptr) {
    if (other.options_ && !options_) fail_nothing_copied(kind_);
  }
  KindOptions(KindOptions&&) noexcept = default;
  KindOptions& operator=(KindOptions other) noexcept {
    kind_ = std::move(other.kind_);
    options_ = std::move(other.options_);
    return *this;
  }
  ~KindOptions() = default;

  bool is_made() const { return options_ != nullptr; }
  /// Once describe() or set() was called.
  const Options& operator*() const { return *options_; }
  const Options* operator->() const { return options_.get(); }

  void set(std::string kind, std::unique_ptr<Options> options) {
    kind_ = std::move(kind);
    options_ = std::move(options);
  }

  /// Describes the keys of a kind.
  /// what      in messages: "sensor"
  /// throws    Config: no such kind; Internal: one of a plug-in that makes nothing
  void describe(SchemaVisitor& visit, std::span<const Info> table, std::string_view what,
                const std::string& kind) {
    if (!options_ || kind != kind_)
      set(kind, made(find_registered(table, what, kind).make(), what, kind));
    options_->describe(visit);
  }

  /// The kind's own keys as TOML, every one.
  std::string settings_toml() const {
    struct Settings {
      KindOptions kind;
      void describe(SchemaVisitor& visit) { kind.options_->describe(visit); }
    };
    return toml_text(Settings{*this});
  }

  void validate() const {
    if constexpr (requires(const Options& options) { options.validate(); })
      if (options_) options_->validate();
  }

 private:
  std::string kind_;
  std::unique_ptr<Options> options_;
};

/// One of several kinds that a config names, with the kind's own keys beside it.
template <class Info>
class Choice {
 public:
  using Options = typename KindOptions<Info>::Options;

  const std::string& kind() const { return kind_; }
  bool is_made() const { return options_.is_made(); }
  const Options& operator*() const { return *options_; }
  const Options* operator->() const { return &*options_; }

  void set(const std::string& kind, std::unique_ptr<Options> options) {
    kind_ = kind;
    options_.set(kind, std::move(options));
  }

  /// Describes the key that names the kind, which is required, and the keys of that kind.
  void describe(SchemaVisitor& visit, std::string_view key, std::string_view what,
                std::string_view meaning, std::span<const Info> table) {
    visit.key(key, kind_, meaning, required(one_of(registry_names(table))));
    if (!kind_.empty()) options_.describe(visit, table, what, kind_);  // else a list of keys
  }

  std::string settings_toml() const { return options_.settings_toml(); }
  void validate() const { options_.validate(); }

 private:
  std::string kind_;
  KindOptions<Info> options_;
};

}  // namespace terracast::core
