#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace ocublast {

/// What a numeric key accepts. A struct member keeps its initial value where the key is absent,
/// unless `required`: physics is required, numerics may have a default.
struct RealKey {
  std::string_view unit;  ///< as in the key's suffix, "1" for a pure number
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool above_min = false;  ///< min itself is refused
  bool below_max = false;  ///< max itself is refused
  bool required = false;
  std::string_view help;
  std::string_view advice;  ///< what to do next, printed after a refusal
};

struct IntegerKey {
  std::int64_t min = std::numeric_limits<std::int64_t>::min();
  std::int64_t max = std::numeric_limits<std::int64_t>::max();
  bool required = false;
  std::string_view help;
};

struct TextKey {
  bool required = false;
  std::string_view help;
};

class CaseReader;

/// One table of the case file. Each key is declared by one call that names it, gives its unit,
/// range, default and help, and reads it into the caller's struct. The same calls, made on a
/// listing reader, produce `--list-keys`. Faults are collected, never thrown here.
class Section {
 public:
  void real(std::string_view name, double& value, const RealKey& key);
  void reals(std::string_view name, std::vector<double>& values, const RealKey& key);
  void real3(std::string_view name, std::array<double, 3>& value, const RealKey& key);
  void integer(std::string_view name, std::int64_t& value, const IntegerKey& key);
  void integer(std::string_view name, int& value, const IntegerKey& key);
  void flag(std::string_view name, bool& value, std::string_view help);
  void text(std::string_view name, std::string& value, const TextKey& key);
  void texts(std::string_view name, std::vector<std::string>& values, const TextKey& key);
  /// A path to an existing file, looked up in the mesh directory, then beside the case file.
  void file(std::string_view name, std::filesystem::path& value, const TextKey& key);

  /// One word out of a table of words.
  template <class Enum>
  void choice(std::string_view name, Enum& value,
              std::span<const std::pair<std::string_view, std::type_identity_t<Enum>>> words,
              const TextKey& key) {
    std::vector<std::string_view> accepted;
    std::size_t index = 0;
    for (std::size_t i = 0; i < words.size(); ++i) {
      accepted.push_back(words[i].first);
      if (words[i].second == value) index = i;
    }
    if (words.empty()) return;
    value = words[choice_index(name, index, accepted, key)].second;
  }

  /// Sub-table; reads as empty where it is absent.
  [[nodiscard]] Section table(std::string_view name, std::string_view help = {});
  /// Array of tables `[[name]]`: calls `read` once per entry (once, empty, when listing).
  void tables(std::string_view name, std::string_view help,
              const std::function<void(Section&, std::size_t)>& read);
  /// Whether the case file holds this table or key (always true when listing).
  [[nodiscard]] bool has(std::string_view name) const;
  [[nodiscard]] bool present() const;
  [[nodiscard]] bool listing() const;

  /// Notes a fault at a key of this table (or at the table itself for an empty name).
  void fault(std::string_view name, std::string_view text);
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  friend class CaseReader;
  struct Nodes;
  Section(CaseReader& reader, std::string path, std::shared_ptr<Nodes> nodes)
      : reader_(&reader), path_(std::move(path)), nodes_(std::move(nodes)) {}
  [[nodiscard]] std::size_t choice_index(std::string_view name, std::size_t fallback,
                                         std::span<const std::string_view> accepted,
                                         const TextKey& key);
  CaseReader* reader_;
  std::string path_;
  std::shared_ptr<Nodes> nodes_;
};

/// Reads a case file whole, applies the chosen `[resolution.NAME]` preset and the `--set`
/// overrides, hands out sections and gathers every fault, so that all of them are shown together.
class CaseReader {
 public:
  struct Source {
    std::filesystem::path case_file;
    std::vector<std::string> overrides;  ///< "dotted.key=value", value in TOML or a bare word
    std::filesystem::path mesh_directory;
    std::string solid;  ///< which of several [[solid]] tables this program reads as [solid]
  };
  /// Throws CaseError when the file cannot be read or parsed.
  explicit CaseReader(const Source& source);
  /// A reader without a file: every declared key is listed instead of read.
  [[nodiscard]] static CaseReader make_listing();
  ~CaseReader();
  CaseReader(CaseReader&&) noexcept;
  CaseReader& operator=(CaseReader&&) noexcept;

  /// A top-level table that the caller owns: unread keys in it are faults.
  [[nodiscard]] Section section(std::string_view name, std::string_view help = {});
  [[nodiscard]] bool has(std::string_view section) const;
  /// Names of the solids: of the [[solid]] tables, or one empty name for a single [solid]; none
  /// where there is neither.
  [[nodiscard]] const std::vector<std::string>& solids() const;
  /// Top-level tables that some program reads; any other name is a fault.
  void expect_sections(std::span<const std::string_view> names);
  void expect_sections(std::initializer_list<std::string_view> names) {
    expect_sections(std::span<const std::string_view>(names.begin(), names.size()));
  }
  /// Adds the unknown keys to the faults and throws CaseError if there is any fault at all.
  void finish();
  /// What was read, defaults filled in, as TOML.
  [[nodiscard]] std::string effective() const;
  /// One line per declared key: path, type, unit, range, default, help.
  [[nodiscard]] std::string key_list() const;
  /// Hash of the whole case after presets and overrides; participants compare it at the handshake.
  [[nodiscard]] std::uint64_t hash() const;

 private:
  friend class Section;
  struct State;
  explicit CaseReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ocublast
