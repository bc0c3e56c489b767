#include "coupler/base/case_reader.hpp"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "coupler/base/case_state.hpp"
#include "coupler/base/errors.hpp"

namespace ocublast {

using namespace case_text;

namespace {

/// Entry of a list: by its number, or the table of this name; the list's size where there is none.
std::size_t index_in(const toml::array& array, const std::string& part) {
  char* end = nullptr;
  const auto index = std::strtoul(part.c_str(), &end, 10);
  if (!part.empty() && *end == '\0') return std::min<std::size_t>(index, array.size());
  for (std::size_t i = 0; i < array.size(); ++i)
    if (const auto* table = array.get(i)->as_table();
        table && (*table)["name"].value<std::string>() == part)
      return i;
  return array.size();
}

/// Sets `root` at a dotted key (array entries by index or name) to a TOML value or, failing that, a
/// string.
void apply_override(toml::table& root, const std::string& key, toml::node& value) {
  toml::node* at = &root;
  std::size_t begin = 0;
  while (true) {
    const std::size_t dot = key.find('.', begin);
    const std::string part = key.substr(begin, dot == std::string::npos ? dot : dot - begin);
    const bool last = dot == std::string::npos;
    if (auto* table = at->as_table()) {
      if (last) {
        value.visit([&](auto& v) { table->insert_or_assign(part, v); });
        return;
      }
      at = table->contains(part) ? table->get(part)
                                 : &table->insert(part, toml::table{}).first->second;
    } else if (auto* array = at->as_array()) {
      const auto index = index_in(*array, part);
      if (index >= array->size())
        throw CaseError(fmt::format("--set {}: '{}' is no index or name in a list of {} entries",
                                    key, part, array->size()));
      if (last) {
        value.visit(
            [&](auto& v) { array->replace(array->cbegin() + static_cast<long>(index), v); });
        return;
      }
      at = array->get(index);
    } else {
      throw CaseError(fmt::format("--set {}: '{}' is a value, not a table", key, part));
    }
    begin = dot + 1;
  }
}

toml::table parse_value(const std::string& text) {
  try {
    return toml::parse("value = " + text);
  } catch (const toml::parse_error&) {
    toml::table table;
    table.insert("value", text);
    return table;
  }
}

}  // namespace

CaseReader::CaseReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
CaseReader::~CaseReader() = default;
CaseReader::CaseReader(CaseReader&&) noexcept = default;
CaseReader& CaseReader::operator=(CaseReader&&) noexcept = default;

CaseReader::CaseReader(const Source& source) : state_(std::make_unique<State>()) {
  state_->case_file = source.case_file;
  state_->mesh_directory = source.mesh_directory;
  if (!std::filesystem::is_regular_file(source.case_file))
    throw CaseError(
        fmt::format("{}: no such case file; try cases/run --list", source.case_file.string()));
  try {
    state_->root = toml::parse_file(source.case_file.string());
  } catch (const toml::parse_error& error) {
    throw CaseError(fmt::format("{}:{}: {}", source.case_file.string(),
                                static_cast<unsigned>(error.source().begin.line),
                                error.description()));
  }
  // Overrides first decide the resolution, then the preset is applied, then the overrides win.
  std::vector<std::pair<std::string, toml::table>> overrides;
  for (const auto& text : source.overrides) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
      throw CaseError(fmt::format("--set {}: expected dotted.key=value", text));
    overrides.emplace_back(text.substr(0, equals), parse_value(text.substr(equals + 1)));
  }
  for (auto& [key, value] : overrides)
    if (key == "case.resolution") apply_override(state_->root, key, *value.get("value"));
  if (const auto name = state_->root.at_path("case.resolution").value<std::string>()) {
    const auto* presets = state_->root["resolution"].as_table();
    const auto* preset = presets ? (*presets)[*name].as_table() : nullptr;
    if (preset == nullptr) {
      std::string names;
      if (presets)
        for (const auto& [key, node] : *presets)
          names += (names.empty() ? "" : ", ") + std::string(key.str());
      throw CaseError(fmt::format("{}: case.resolution: '{}' is not defined, accepted: {}",
                                  state_->case_file.string(), *name,
                                  names.empty() ? "none (no [resolution.NAME] table)" : names));
    }
    const toml::table copy = *preset;  // the preset may not be read while the tree changes
    for (const auto& [key, node] : copy) {
      toml::table holder;
      node.visit([&](const auto& v) { holder.insert("value", v); });
      const std::string dotted(key.str());
      apply_override(state_->root, dotted, *holder.get("value"));
      state_->source_of_override[dotted] =
          fmt::format("{}: [resolution.{}]", state_->case_file.string(), *name);
    }
  }
  for (auto& [key, value] : overrides) {
    apply_override(state_->root, key, *value.get("value"));
    state_->source_of_override[key] = "--set";
  }
  std::ostringstream out;
  out << toml::toml_formatter{state_->root, toml::format_flags::none};
  state_->hash = fnv1a(out.str());
  state_->choose_solid(source.solid);
}

void CaseReader::State::choose_solid(const std::string& wanted) {
  auto* array = root.contains("solid") ? root.get("solid")->as_array() : nullptr;
  if (array == nullptr) {
    if (root.contains("solid")) solids.emplace_back();
    if (!wanted.empty())
      throw CaseError(fmt::format("--name {}: the case has no list of tables [[solid]]", wanted));
    return;
  }
  toml::table* chosen = nullptr;
  for (auto& entry : *array) {
    auto* table = entry.as_table();
    const std::string name = table ? (*table)["name"].value_or(std::string()) : std::string();
    const bool plain = !name.empty() && name != "flow" && name != "coupler" && name != "log" &&
                       name != "checkpoint" &&
                       std::all_of(name.begin(), name.end(), [](unsigned char c) {
                         return std::isalnum(c) || c == '_' || c == '-';
                       });
    if (!plain)
      faults.push_back(place("solid", &entry) +
                       ": each of several solids needs a name of letters, digits, _ and -");
    else if (std::find(solids.begin(), solids.end(), name) != solids.end())
      faults.push_back(fmt::format("{}: two solids are called '{}'", place("solid", &entry), name));
    else
      solids.push_back(name);
    if (table != nullptr && name == wanted) chosen = table;
  }
  if (wanted.empty()) return;
  if (chosen == nullptr)
    throw CaseError(fmt::format("--name {}: no solid is called so; there are {}", wanted,
                                fmt::join(solids, ", ")));
  toml::table copy = *chosen;
  copy.erase("name");
  root.insert_or_assign("solid", std::move(copy));
}

const std::vector<std::string>& CaseReader::solids() const {
  return state_->solids;
}

CaseReader CaseReader::make_listing() {
  auto state = std::make_unique<State>();
  state->listing = true;
  return CaseReader(std::move(state));
}

Section CaseReader::section(std::string_view name, std::string_view help) {
  const std::string key(name);
  state_->owned.insert(key);
  auto nodes = std::make_shared<Section::Nodes>();
  if (const auto* node = state_->root.get(key)) {
    nodes->table = node->as_table();
    if (nodes->table == nullptr)
      state_->faults.push_back(state_->place(key, node) +
                               (key == "solid" && node->is_array()
                                    ? ": several solids: --name says which one"
                                    : ": expected a table"));
  }
  if (state_->listing && !help.empty()) state_->keys.push_back(fmt::format("[{}]  {}", name, help));
  if (nodes->table != nullptr || state_->listing)
    nodes->effective = state_->effective.insert(key, toml::table{}).first->second.as_table();
  return {*this, key, std::move(nodes)};
}

bool CaseReader::has(std::string_view section) const {
  return state_->listing || state_->root.contains(section);
}

void CaseReader::expect_sections(std::span<const std::string_view> names) {
  const std::set<std::string> known(names.begin(), names.end());
  for (const auto& [key, node] : state_->root) {
    const std::string name(key.str());
    if (known.contains(name)) continue;
    const std::string nearest = nearest_word(name, known);
    state_->faults.push_back(
        fmt::format("{}: no such table{}", state_->place(name, &node),
                    nearest.empty() ? std::string() : "; did you mean '" + nearest + "'?"));
  }
}

void CaseReader::finish() {
  for (const auto& name : state_->owned)
    if (const auto* table = state_->root[name].as_table()) state_->add_unknown_keys(*table, name);
  if (state_->faults.empty()) return;
  std::string text;
  for (const auto& fault : state_->faults) text += (text.empty() ? "" : "\n") + fault;
  throw CaseError(text);
}

std::string CaseReader::effective() const {
  std::ostringstream out;
  out << toml::toml_formatter{state_->effective, toml::format_flags::none} << '\n';
  return out.str();
}

std::string CaseReader::key_list() const {
  std::string text;
  for (const auto& line : state_->keys) text += line + '\n';
  return text;
}

std::uint64_t CaseReader::hash() const {
  return state_->hash;
}

}  // namespace ocublast
