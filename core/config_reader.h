#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "core/config_tree.h"
#include "core/key_hints.h"
#include "core/schema.h"

namespace terracast::core {

/// Fills a described struct from a config tree; the visitor behind TomlDocument::read().
class ConfigReader : public SchemaVisitor, public KeyHints {
 public:
  /// root   the whole config; lives longer than the reader
  ConfigReader(const ConfigNode& root, ConfigLoader load);

  /// Refuses unknown and missing keys of the top level.
  void finish() const { check_keys(frames_.front()); }

  void hint(std::string_view key, const std::string& hint) override {
    frames_.back().hints[std::string(key)] = hint;
  }

 protected:
  void visit_value(std::string_view name, ValueRef value, std::string_view meaning,
                   const Constraint& constraint) override;
  bool begin_section(std::string_view name, std::string_view meaning) override;
  void end_section() override;
  std::size_t begin_list(std::string_view name, std::string_view meaning,
                         std::size_t current_size) override;
  void end_list() override { lists_.pop_back(); }
  void begin_item(std::size_t index) override;
  void end_item() override { end_section(); }
  bool replaces_items() const override { return lists_.back().items != nullptr; }
  bool runs_validation() const override { return frames_.back().table != nullptr; }
  void locate(Error& error) const override;

 private:
  struct Frame {
    const ConfigNode* table = nullptr;  ///< null: not in the config, defaults stay
    std::string name;                   ///< "world.layers", "rigs[0]"; empty at the top
    std::vector<std::string> known;
    std::vector<std::string> missing;  ///< required keys that are not there, with their meaning
    std::map<std::string, std::string> hints = {};  ///< of keys of other choices
  };
  struct List {
    const ConfigList* items = nullptr;  ///< null: not in the config, defaults stay
    std::string name;
  };

  const ConfigNode* find(std::string_view name);
  std::string full_name(std::string_view name) const;
  void push_table(const ConfigNode& node, const std::string& name);
  void check_keys(const Frame& frame) const;

  void read_into(bool& out, const ConfigNode& node, const std::string& name,
                 const Constraint& constraint) const;
  void read_into(std::int64_t& out, const ConfigNode& node, const std::string& name,
                 const Constraint& constraint) const;
  void read_into(double& out, const ConfigNode& node, const std::string& name,
                 const Constraint& constraint) const;
  void read_into(std::string& out, const ConfigNode& node, const std::string& name,
                 const Constraint& constraint) const;
  void read_into(Path& out, const ConfigNode& node, const std::string& name,
                 const Constraint& constraint) const;
  void read_into(AnyValue& out, const ConfigNode& node, const std::string& name,
                 const Constraint& constraint) const;
  template <class T>
  void read_into(std::vector<T>& out, const ConfigNode& node, const std::string& name,
                 const Constraint& constraint) const;

  const ConfigNode& root_;
  ConfigLoader load_;
  std::deque<ConfigNode> loaded_;  ///< the files that sections name
  std::vector<Frame> frames_;
  std::vector<List> lists_;
};

}  // namespace terracast::core
