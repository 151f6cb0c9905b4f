#include "rigs/opencv_xml.h"

#include <yaml-cpp/yaml.h>

#include <pugixml.hpp>
#include <sstream>

#include "core/error.h"
#include "geo/fixes/text.h"

namespace terracast::rigs {
namespace {

constexpr int kDeepest = 20;
constexpr const char* kRoot = "opencv_storage";

bool has_elements(const pugi::xml_node& element) {
  for (const pugi::xml_node& child : element)
    if (child.type() == pugi::node_element) return true;
  return false;
}

/// Texts with blanks stand between quotation marks.
std::string without_quotes(std::string text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  const std::size_t end = text.find_last_not_of(" \t\r\n");
  text = begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"')
    return text.substr(1, text.size() - 2);
  return text;
}

bool has_several_numbers(const std::string& text) {
  std::istringstream words(text);
  std::size_t num_words = 0;
  for (std::string word; words >> word; ++num_words)
    if (!geo::number_of(word)) return false;
  return num_words > 1;
}

YAML::Node list_of_words(const std::string& text) {
  YAML::Node list(YAML::NodeType::Sequence);
  std::istringstream words(text);
  for (std::string word; words >> word;) list.push_back(word);
  return list;
}

YAML::Node node_of(const pugi::xml_node& element, int depth, const std::string& file) {
  if (depth > kDeepest)
    core::fail(core::ErrorKind::Input, "{}: elements within each other more than {} deep", file,
               kDeepest);
  if (!has_elements(element)) {
    const std::string text = element.text().get();
    return std::string_view(element.name()) == "data" || has_several_numbers(text)
               ? list_of_words(text)
               : YAML::Node(without_quotes(text));
  }
  YAML::Node node;
  const bool is_list = element.child("_");
  for (const pugi::xml_node& child : element) {
    if (child.type() != pugi::node_element) continue;
    const YAML::Node value = node_of(child, depth + 1, file);
    if ((std::string_view(child.name()) == "_") != is_list)
      core::fail(core::ErrorKind::Input, "{}: <{}> has both items and names in it", file,
                 element.name());
    if (is_list)
      node.push_back(value);
    else
      node.force_insert(std::string(child.name()), value);
  }
  return node;
}

}  // namespace

bool is_opencv_xml(std::string_view text) {
  return text.find("<opencv_storage") != std::string_view::npos;
}

YAML::Node node_of_opencv_xml(const std::string& text, const std::string& file) {
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
  if (!result)
    core::fail(core::ErrorKind::Input, "{}: byte {}: no XML: {}", file, result.offset,
               result.description());
  const pugi::xml_node root = document.child(kRoot);
  if (!root) core::fail(core::ErrorKind::Input, "{}: no <{}> of OpenCV", file, kRoot);
  return node_of(root, 0, file);
}

}  // namespace terracast::rigs
