#pragma once

// What the parts of the case reader share; nobody else includes this.

#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>
#define TOML_ENABLE_FORMATTERS 1
#include <toml++/toml.h>

#include "coupler/base/case_reader.hpp"

namespace ocublast {
namespace case_text {

/// Word of `known` that is nearest in spelling; empty where none is near.
[[nodiscard]] std::string nearest_word(std::string_view word, const std::set<std::string>& known);
[[nodiscard]] std::string number_text(double value);
[[nodiscard]] std::string range_text(const RealKey& key);
[[nodiscard]] bool in_range(double value, const RealKey& key);
[[nodiscard]] std::string with_unit(std::string_view number, std::string_view unit);
[[nodiscard]] std::string value_text(const toml::node& node);
/// Dotted path of a key.
[[nodiscard]] std::string join(std::string_view path, std::string_view name);
[[nodiscard]] std::uint64_t fnv1a(std::string_view text);

}  // namespace case_text

struct Section::Nodes {
  const toml::table* table = nullptr;  ///< null where the case file has no such table
  toml::table* effective = nullptr;    ///< where the values read are kept
};

struct CaseReader::State {
  bool listing = false;
  std::filesystem::path case_file;
  std::filesystem::path mesh_directory;
  toml::table root;
  toml::table effective;
  std::vector<std::string> faults;
  std::vector<std::string> keys;
  std::vector<std::string> solids;                     ///< names; one empty name: a single [solid]
  std::uint64_t hash = 0;                              ///< of the whole case
  std::set<std::string> owned;                         ///< top-level tables read here
  std::map<std::string, std::set<std::string>> known;  ///< table path -> names declared
  std::map<std::string, std::string> source_of_override;  ///< dotted key -> where it was set

  [[nodiscard]] std::string place(const std::string& path, const toml::node* node) const {
    const auto set_by = source_of_override.find(path);
    if (set_by != source_of_override.end()) return fmt::format("{}: {}", set_by->second, path);
    const auto line = node != nullptr ? node->source().begin.line : 0U;
    if (line == 0U) return fmt::format("{}: {}", case_file.string(), path);
    return fmt::format("{}:{}: {}", case_file.string(), static_cast<unsigned>(line), path);
  }

  /// Notes the solids' names; where one is wanted its table becomes [solid].
  void choose_solid(const std::string& wanted);

  void add_unknown_keys(const toml::table& table, const std::string& path) {
    const auto& names = known[path];
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      const std::string full = case_text::join(path, name);
      if (!names.contains(name)) {
        const std::string nearest = case_text::nearest_word(name, names);
        faults.push_back(fmt::format("{}: no such key{}", place(full, &node),
                                     nearest.empty() ? std::string("; see --list-keys")
                                                     : "; did you mean '" + nearest + "'?"));
      } else if (const auto* child = node.as_table()) {
        add_unknown_keys(*child, full);
      } else if (const auto* array = node.as_array(); array && array->is_array_of_tables()) {
        for (const auto& entry : *array) add_unknown_keys(*entry.as_table(), full);
      }
    }
  }
};

}  // namespace ocublast
