#include "coupler/base/case_reader.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include <fmt/format.h>
#define TOML_ENABLE_FORMATTERS 1
#include <toml++/toml.h>

#include "coupler/base/errors.hpp"

namespace ocublast {
namespace {

/// Number of single-letter edits between two words (Levenshtein 1966).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

/// The known word nearest to `word`, also one that differs only in its unit suffix; else empty.
std::string nearest_word(std::string_view word, const std::set<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(3, word.size() / 2);
  const auto stem = [](std::string_view w) { return w.substr(0, w.find('_')); };
  for (const auto& candidate : known) {
    std::size_t distance = edit_distance(word, candidate);
    if (stem(word) == stem(candidate)) distance = std::min<std::size_t>(distance, 2);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string number_text(double value) { return fmt::format("{:.10g}", value); }

std::string range_text(const RealKey& key) {
  const bool bounded_below = std::isfinite(key.min);
  const bool bounded_above = std::isfinite(key.max);
  if (!bounded_below && !bounded_above) return "any number";
  if (!bounded_above) return fmt::format("{} {}", key.above_min ? ">" : ">=", number_text(key.min));
  if (!bounded_below) return fmt::format("{} {}", key.below_max ? "<" : "<=", number_text(key.max));
  return fmt::format("{}{}, {}{}", key.above_min ? '(' : '[', number_text(key.min),
                     number_text(key.max), key.below_max ? ')' : ']');
}

bool in_range(double value, const RealKey& key) {
  if (!std::isfinite(value)) return false;
  if (value < key.min || (key.above_min && value == key.min)) return false;
  return value <= key.max && !(key.below_max && value == key.max);
}

std::string with_unit(std::string_view number, std::string_view unit) {
  return unit.empty() || unit == "1" ? std::string(number) : fmt::format("{} {}", number, unit);
}

std::string value_text(const toml::node& node) {
  std::ostringstream out;
  node.visit([&](const auto& value) { out << value; });
  std::string text = out.str();
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

std::string join(std::string_view path, std::string_view name) {
  if (path.empty()) return std::string(name);
  if (name.empty()) return std::string(path);
  return fmt::format("{}.{}", path, name);
}

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return hash;
}

}  // namespace

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
  std::set<std::string> owned;                            ///< top-level tables read here
  std::map<std::string, std::set<std::string>> known;     ///< table path -> names declared
  std::map<std::string, std::string> source_of_override;  ///< dotted key -> where it was set

  [[nodiscard]] std::string place(const std::string& path, const toml::node* node) const {
    const auto set_by = source_of_override.find(path);
    if (set_by != source_of_override.end()) return fmt::format("{}: {}", set_by->second, path);
    const auto line = node != nullptr ? node->source().begin.line : 0U;
    if (line == 0U) return fmt::format("{}: {}", case_file.string(), path);
    return fmt::format("{}:{}: {}", case_file.string(), static_cast<unsigned>(line), path);
  }

  void add_unknown_keys(const toml::table& table, const std::string& path) {
    const auto& names = known[path];
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      const std::string full = join(path, name);
      if (!names.contains(name)) {
        const std::string nearest = nearest_word(name, names);
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

namespace {

/// Sets `root` at a dotted key (array entries by index) to a TOML value or, failing that, a string.
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
      char* end = nullptr;
      const auto index = std::strtoul(part.c_str(), &end, 10);
      if (*end != '\0' || index >= array->size())
        throw CaseError(fmt::format("--set {}: '{}' is no index of a list of {} entries", key, part,
                                    array->size()));
      if (last) {
        value.visit([&](auto& v) { array->replace(array->cbegin() + static_cast<long>(index), v); });
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
    throw CaseError(fmt::format("{}: no such case file; try cases/run --list",
                                source.case_file.string()));
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
      state_->faults.push_back(state_->place(key, node) + ": expected a table");
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
    state_->faults.push_back(fmt::format("{}: no such table{}", state_->place(name, &node),
                                         nearest.empty() ? std::string()
                                                         : "; did you mean '" + nearest + "'?"));
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
  std::ostringstream out;
  out << toml::toml_formatter{state_->root, toml::format_flags::none};
  return fnv1a(out.str());
}

// --- Section -------------------------------------------------------------------------------------

namespace {

template <class T>
void keep(toml::table* effective, std::string_view name, const T& value) {
  if (effective != nullptr) effective->insert_or_assign(name, value);
}

}  // namespace

bool Section::listing() const { return reader_->state_->listing; }
bool Section::present() const { return listing() || nodes_->table != nullptr; }
bool Section::has(std::string_view name) const {
  return listing() || (nodes_->table != nullptr && nodes_->table->contains(name));
}

void Section::fault(std::string_view name, std::string_view text) {
  const toml::node* node = nodes_->table;
  if (node != nullptr && !name.empty() && nodes_->table->contains(name))
    node = nodes_->table->get(name);
  const std::string full = join(path_, name);
  reader_->state_->faults.push_back(fmt::format("{}: {}", reader_->state_->place(full, node), text));
}

namespace {

/// Says in a listing what a key is.
std::string describe(std::string_view path, std::string_view type, std::string_view unit,
                     std::string_view accepted, bool required, std::string_view fallback,
                     std::string_view help) {
  return fmt::format("{}  {}{}{}  accepted {}  {}  {}", path, type, unit.empty() ? "" : " in ", unit,
                     accepted, required ? "required" : fmt::format("default {}", fallback), help);
}

}  // namespace

#define OCU_LOOK_UP_OR_RETURN(type_name, unit, accepted, default_text)                             \
  auto& state = *reader_->state_;                                                                  \
  state.known[path_].insert(std::string(name));                                                    \
  if (state.listing) {                                                                             \
    state.keys.push_back(describe(join(path_, name), type_name, unit, accepted, key.required,      \
                                  default_text, key.help));                                        \
    return;                                                                                        \
  }                                                                                                \
  const toml::node* node = nodes_->table != nullptr ? nodes_->table->get(name) : nullptr;          \
  if (node == nullptr) {                                                                           \
    if (key.required)                                                                              \
      fault(name, fmt::format("missing, accepted {}: {}", accepted, key.help));                    \
  }

void Section::real(std::string_view name, double& value, const RealKey& key) {
  const std::string accepted = with_unit(range_text(key), key.unit);
  OCU_LOOK_UP_OR_RETURN("number", key.unit, accepted, number_text(value))
  if (node != nullptr) {
    if (!node->is_number()) {
      fault(name, fmt::format("is {}, expected a number in {}", value_text(*node), key.unit));
      return;
    }
    const double found = *node->value<double>();
    if (!in_range(found, key)) {
      fault(name, fmt::format("{} is {}, accepted {}{}{}", name,
                              with_unit(number_text(found), key.unit), accepted,
                              key.advice.empty() ? "" : "; ", key.advice));
      return;
    }
    value = found;
  }
  keep(nodes_->effective, name, value);
}

void Section::reals(std::string_view name, std::vector<double>& values, const RealKey& key) {
  const std::string accepted = "a list of numbers " + with_unit(range_text(key), key.unit);
  OCU_LOOK_UP_OR_RETURN("numbers", key.unit, accepted, fmt::format("{} values", values.size()))
  if (node != nullptr) {
    const auto* array = node->as_array();
    if (array == nullptr) {
      fault(name, fmt::format("is {}, expected {}", value_text(*node), accepted));
      return;
    }
    std::vector<double> found;
    for (const auto& entry : *array) {
      if (!entry.is_number() || !in_range(*entry.value<double>(), key)) {
        fault(name, fmt::format("holds {}, accepted {}", value_text(entry), accepted));
        return;
      }
      found.push_back(*entry.value<double>());
    }
    values = std::move(found);
  }
  toml::array kept;
  for (const double v : values) kept.push_back(v);
  keep(nodes_->effective, name, kept);
}

void Section::real3(std::string_view name, std::array<double, 3>& value, const RealKey& key) {
  std::vector<double> values(value.begin(), value.end());
  const std::size_t before = reader_->state_->faults.size();
  reals(name, values, key);
  if (listing() || reader_->state_->faults.size() != before) return;
  if (values.size() != 3) {
    fault(name, fmt::format("has {} numbers, expected 3 (x, y, z in {})", values.size(), key.unit));
    return;
  }
  std::copy(values.begin(), values.end(), value.begin());
}

void Section::integer(std::string_view name, std::int64_t& value, const IntegerKey& key) {
  const std::string accepted = range_text({.min = key.min == std::numeric_limits<std::int64_t>::min()
                                                      ? -std::numeric_limits<double>::infinity()
                                                      : static_cast<double>(key.min),
                                           .max = key.max == std::numeric_limits<std::int64_t>::max()
                                                      ? std::numeric_limits<double>::infinity()
                                                      : static_cast<double>(key.max)});
  OCU_LOOK_UP_OR_RETURN("integer", "", accepted, std::to_string(value))
  if (node != nullptr) {
    const auto found = node->value_exact<std::int64_t>();
    if (!found) {
      fault(name, fmt::format("is {}, expected a whole number", value_text(*node)));
      return;
    }
    if (*found < key.min || *found > key.max) {
      fault(name, fmt::format("{} is {}, accepted {}", name, *found, accepted));
      return;
    }
    value = *found;
  }
  keep(nodes_->effective, name, value);
}

void Section::integer(std::string_view name, int& value, const IntegerKey& key) {
  std::int64_t wide = value;
  IntegerKey narrow = key;
  narrow.min = std::max<std::int64_t>(key.min, std::numeric_limits<int>::min());
  narrow.max = std::min<std::int64_t>(key.max, std::numeric_limits<int>::max());
  integer(name, wide, narrow);
  value = static_cast<int>(wide);
}

void Section::flag(std::string_view name, bool& value, std::string_view help) {
  const TextKey key{.help = help};
  OCU_LOOK_UP_OR_RETURN("flag", "", "true, false", value ? "true" : "false")
  if (node != nullptr) {
    if (!node->is_boolean()) {
      fault(name, fmt::format("is {}, accepted true, false", value_text(*node)));
      return;
    }
    value = *node->value<bool>();
  }
  keep(nodes_->effective, name, value);
}

void Section::text(std::string_view name, std::string& value, const TextKey& key) {
  OCU_LOOK_UP_OR_RETURN("text", "", "text", fmt::format("'{}'", value))
  if (node != nullptr) {
    if (!node->is_string()) {
      fault(name, fmt::format("is {}, expected text in quotes", value_text(*node)));
      return;
    }
    value = *node->value<std::string>();
  }
  keep(nodes_->effective, name, value);
}

void Section::texts(std::string_view name, std::vector<std::string>& values, const TextKey& key) {
  OCU_LOOK_UP_OR_RETURN("texts", "", "a list of texts", fmt::format("{} entries", values.size()))
  if (node != nullptr) {
    const auto* array = node->as_array();
    if (array == nullptr) {
      fault(name, fmt::format("is {}, expected a list of texts", value_text(*node)));
      return;
    }
    std::vector<std::string> found;
    for (const auto& entry : *array) {
      if (!entry.is_string()) {
        fault(name, fmt::format("holds {}, expected texts only", value_text(entry)));
        return;
      }
      found.push_back(*entry.value<std::string>());
    }
    values = std::move(found);
  }
  toml::array kept;
  for (const auto& v : values) kept.push_back(v);
  keep(nodes_->effective, name, kept);
}

void Section::file(std::string_view name, std::filesystem::path& value, const TextKey& key) {
  std::string given = value.string();
  const std::size_t before = reader_->state_->faults.size();
  text(name, given, key);
  if (listing() || given.empty() || reader_->state_->faults.size() != before) return;
  const auto& state = *reader_->state_;
  std::vector<std::filesystem::path> tried;
  if (std::filesystem::path(given).is_absolute()) {
    tried.emplace_back(given);
  } else {
    if (!state.mesh_directory.empty()) tried.push_back(state.mesh_directory / given);
    tried.push_back(state.case_file.parent_path() / given);
  }
  for (const auto& candidate : tried)
    if (std::filesystem::is_regular_file(candidate)) {
      value = candidate;
      return;
    }
  std::string places;
  for (const auto& candidate : tried) places += (places.empty() ? "" : ", ") + candidate.string();
  fault(name, fmt::format("no such file: '{}' (looked at {}); cases/run makes the meshes of a case",
                          given, places));
}

std::size_t Section::choice_index(std::string_view name, std::size_t fallback,
                                  std::span<const std::string_view> accepted, const TextKey& key) {
  std::string words;
  for (const auto& word : accepted) words += (words.empty() ? "" : ", ") + std::string(word);
  auto& state = *reader_->state_;
  state.known[path_].insert(std::string(name));
  if (state.listing) {
    state.keys.push_back(describe(join(path_, name), "word", "", words, key.required,
                                  accepted[fallback], key.help));
    return fallback;
  }
  const toml::node* node = nodes_->table != nullptr ? nodes_->table->get(name) : nullptr;
  if (node == nullptr) {
    if (key.required) fault(name, fmt::format("missing, accepted: {}: {}", words, key.help));
  } else {
    const auto found = node->value<std::string>();
    const auto at = found ? std::find(accepted.begin(), accepted.end(), *found) : accepted.end();
    if (at == accepted.end()) {
      const std::string nearest =
          found ? nearest_word(*found, {accepted.begin(), accepted.end()}) : std::string();
      fault(name, fmt::format("is {}, accepted: {}{}", value_text(*node), words,
                              nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
      return fallback;
    }
    fallback = static_cast<std::size_t>(at - accepted.begin());
  }
  keep(nodes_->effective, name, std::string(accepted[fallback]));
  return fallback;
}

Section Section::table(std::string_view name, std::string_view help) {
  auto& state = *reader_->state_;
  state.known[path_].insert(std::string(name));
  auto nodes = std::make_shared<Nodes>();
  const std::string full = join(path_, name);
  if (state.listing) state.keys.push_back(fmt::format("[{}]  {}", full, help));
  if (nodes_->table != nullptr)
    if (const auto* node = nodes_->table->get(name)) {
      nodes->table = node->as_table();
      if (nodes->table == nullptr) fault(name, "expected a table");
    }
  if (nodes->table != nullptr && nodes_->effective != nullptr)
    nodes->effective =
        nodes_->effective->insert_or_assign(name, toml::table{}).first->second.as_table();
  return {*reader_, full, std::move(nodes)};
}

void Section::tables(std::string_view name, std::string_view help,
                     const std::function<void(Section&, std::size_t)>& read) {
  auto& state = *reader_->state_;
  state.known[path_].insert(std::string(name));
  const std::string full = join(path_, name);
  if (state.listing) {
    state.keys.push_back(fmt::format("[[{}]]  {}", full, help));
    Section entry(*reader_, full, std::make_shared<Nodes>());
    read(entry, 0);
    return;
  }
  const toml::node* node = nodes_->table != nullptr ? nodes_->table->get(name) : nullptr;
  if (node == nullptr) return;
  const auto* array = node->as_array();
  if (array == nullptr || !array->is_array_of_tables()) {
    fault(name, fmt::format("expected tables [[{}]]", full));
    return;
  }
  auto* kept = nodes_->effective->insert_or_assign(name, toml::array{}).first->second.as_array();
  for (std::size_t i = 0; i < array->size(); ++i) kept->push_back(toml::table{});
  for (std::size_t i = 0; i < array->size(); ++i) {
    auto nodes = std::make_shared<Nodes>();
    nodes->table = array->get(i)->as_table();
    nodes->effective = kept->get(i)->as_table();
    Section entry(*reader_, full, std::move(nodes));
    read(entry, i);
  }
}

#undef OCU_LOOK_UP_OR_RETURN

}  // namespace ocublast
