#pragma once

#include <string>
#include <string_view>

namespace YAML {
class Node;
}

namespace terracast::rigs {

/// Whether a text begins as OpenCV's FileStorage writes XML.
bool is_opencv_xml(std::string_view text);

/// The same values as OpenCV's FileStorage writes as YAML: elements are keys, those called _ items of a list, numbers in
/// <data> a list.
/// file     for messages
/// throws   Input: no XML, no opencv_storage, elements in each other more than 20 deep
YAML::Node node_of_opencv_xml(const std::string& text, const std::string& file);

}  // namespace terracast::rigs
