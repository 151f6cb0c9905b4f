#pragma once

#include <pugixml.hpp>
#include <span>
#include <string>
#include <string_view>

#include "core/ledger.h"

namespace terracast::geo {

/// What the reader of GPX makes of elements and attributes: "trkpt/ele", "trkpt@lat", "extensions/speed".
std::span<const core::KnownName> known_gpx_names();

/// The name of an element or attribute without its prefix.
std::string_view local_name(std::string_view qualified);

/// The names of a GPX file, in whatever namespace and with whatever prefixes it was written.
class GpxNames {
 public:
  explicit GpxNames(const pugi::xml_node& gpx);

  /// An element of GPX itself with that name.
  bool is(const pugi::xml_node& element, std::string_view name) const;
  /// The name that a ledger has of an element: without the prefix where the namespace is GPX's own, or one of the
  /// extensions that are known; with it otherwise.
  std::string name_of(const pugi::xml_node& element) const;

  /// Counts an element's own attributes, as "trkpt@lat"; declarations of namespaces are none.
  void count_attributes(const pugi::xml_node& element, std::string_view name,
                        core::Ledger& ledger) const;
  /// Counts all that stands below <extensions>, as "extensions/hr" where the path is "extensions".
  void count_extensions(const pugi::xml_node& extensions, std::string_view path,
                        core::Ledger& ledger) const;

 private:
  std::string namespace_;  ///< of <gpx>
};

/// The address of an element's namespace; one that is not declared is "prefix:".
std::string namespace_of(const pugi::xml_node& element);

}  // namespace terracast::geo
