#include "coupler/base/log.hpp"

#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <cstdio>
#include <vector>

#include "coupler/base/errors.hpp"

namespace ocublast {

std::shared_ptr<spdlog::logger> make_logger(const std::string& program,
                                            const std::filesystem::path& file) {
  auto console = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  console->set_level(spdlog::level::warn);
  console->set_pattern("%n: %v");
  std::vector<spdlog::sink_ptr> sinks{console};
  if (!file.empty()) {
    std::filesystem::create_directories(file.parent_path());
    sinks.push_back(std::make_shared<spdlog::sinks::basic_file_sink_mt>(file.string(), true));
  }
  auto logger = std::make_shared<spdlog::logger>(program, sinks.begin(), sinks.end());
  logger->set_level(spdlog::level::info);
  logger->flush_on(spdlog::level::info);
  return logger;
}

int report_current_exception(const std::string& program) noexcept {
  const auto say = [&](const char* kind, const char* text) {
    std::fprintf(stderr, "%s: %s\n%s\n", program.c_str(), kind, text);
  };
  try {
    throw;
  } catch (const CaseError& error) {
    say("the case cannot run:", error.what());
    return static_cast<int>(ExitCode::bad_case);
  } catch (const LinkError& error) {
    say("link failed:", error.what());
    return static_cast<int>(ExitCode::link);
  } catch (const NumericsError& error) {
    say("computation failed:", error.what());
    return static_cast<int>(ExitCode::numerics);
  } catch (const std::exception& error) {
    say("stopped:", error.what());
  } catch (...) {
    say("stopped:", "unknown exception");
  }
  return static_cast<int>(ExitCode::other);
}

}  // namespace ocublast
