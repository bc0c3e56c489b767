// What comes from outside, torn apart: header frames, payloads, interface meshes, recordings. A
// hostile input may be refused with LinkError; it may not crash, hang, or come back different. With
// clang: clang++ -fsanitize=fuzzer,address ... (tests/faults/fuzz); without: coupler_fuzz_main.cpp.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "coupler/base/errors.hpp"
#include "coupler/link/message.hpp"
#include "coupler/link/payload.hpp"
#include "coupler/recording.hpp"

namespace {

using ocublast::LinkError;
namespace link_ = ocublast::link;

[[noreturn]] void broken(const char* what) {
  std::fprintf(stderr, "coupler_fuzz: %s\n", what);
  std::abort();
}

/// Input: two bytes of header length, the header, the payload.
void try_message(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return;
  const std::size_t header_size = std::min<std::size_t>(data[0] + 256U * data[1], size - 2);
  const std::string header_bytes(reinterpret_cast<const char*>(data + 2), header_size);
  link_::Header header;
  try {
    header = link_::decode(header_bytes);
  } catch (const LinkError&) {
    return;
  }
  // What was accepted says the same when it is written again (bytes are compared: a number that is
  // not finite differs from itself).
  const std::string again = link_::encode(header);
  if (link_::encode(link_::decode(again)) != again)
    broken("a header changes when it is written and read");
  const std::size_t rest = size - 2 - header_size;
  std::vector<double> aligned((rest + sizeof(double) - 1) / sizeof(double));
  if (rest > 0) std::memcpy(aligned.data(), data + 2 + header_size, rest);
  const std::span<const std::byte> payload(reinterpret_cast<const std::byte*>(aligned.data()),
                                           rest);
  try {
    link_::check_payload(header, payload);
    if ((header.fields & link_::field::mesh) != 0)
      static_cast<void>(link_::mesh_from_payload(header, payload));
    else
      static_cast<void>(link_::view_payload(header, payload));
  } catch (const LinkError&) {
  }
}

void try_recording(const std::uint8_t* data, std::size_t size) {
  const int fd = ::memfd_create("recording", MFD_CLOEXEC);
  if (fd < 0 || ::write(fd, data, size) != static_cast<ssize_t>(size))
    broken("no memory for a file");
  try {
    ocublast::coupler::TrafficReader reader("/proc/self/fd/" + std::to_string(fd));
    while (reader.next()) continue;
  } catch (const LinkError&) {
  }
  ::close(fd);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0 && data[0] == 'O')
    try_recording(data, size);  // as its magic begins
  else
    try_message(data, size);
  return 0;
}
