// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The journal of a campaign (component jml::campaign): finished blocks in a file, so that a session that was
/// killed goes on where it stood. POSIX.
///
/// The file: 8 bytes of magic, then frames {length, CRC-64, bytes}. The first frame is the identity of the
/// campaign as JSON text; each other one is a block, in the machine's own byte order. A frame is appended by
/// one write; a torn last one fails its length or checksum and is cut off at the next start.
#include <jml/warnings_begin.hpp>
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <boost/crc.hpp>
#include <cerrno>
#include <functional>
#include <jml/campaign/campaign_report.hpp>

namespace jml::detail {

using Bytes = std::vector<char>;

inline void put(Bytes& to, const void* from, std::size_t size) {
  const char* first = static_cast<const char*>(from);
  to.insert(to.end(), first, first + size);
}

/// The block as bytes: number, count of faults, sums, times, faults.
inline Bytes to_bytes(const BlockRecord& record) {
  Bytes out;
  const std::array<std::int64_t, 2> numbers{record.block, static_cast<std::int64_t>(record.faults.size())};
  out.reserve(sizeof numbers + (record.sums.size() + record.times.size()) * sizeof(double) +
              record.faults.size() * sizeof(RunFault));
  put(out, numbers.data(), sizeof numbers);
  put(out, record.sums.data(), record.sums.size() * sizeof(double));
  put(out, record.times.data(), record.times.size() * sizeof(double));
  for (const RunFault& f : record.faults) {
    const std::array<std::int64_t, 5> whole{f.run, f.estimator, f.step, static_cast<std::int64_t>(f.kind),
                                            static_cast<std::int64_t>(f.status)};
    put(out, whole.data(), sizeof whole);
    put(out, &f.scalar_error, sizeof f.scalar_error);
  }
  return out;
}

/// False where the bytes are not a block of this layout.
inline bool from_bytes(const Bytes& bytes, const TallyLayout& layout, BlockRecord& record) {
  constexpr std::size_t fault_size = 5 * sizeof(std::int64_t) + sizeof(double);
  std::array<std::int64_t, 2> numbers;
  if (bytes.size() < sizeof numbers) return false;
  const char* from = bytes.data();
  const auto get = [&from](void* to, std::size_t size) {
    std::memcpy(to, from, size);
    from += size;
  };
  get(numbers.data(), sizeof numbers);
  const std::size_t left = bytes.size() - sizeof numbers;
  const std::size_t fixed = (layout.size() + layout.time_size()) * sizeof(double);
  if (left < fixed || (left - fixed) % fault_size != 0) return false;
  const std::size_t faults = (left - fixed) / fault_size;
  if (static_cast<std::int64_t>(faults) != numbers[1]) return false;
  record.start(layout, static_cast<int>(numbers[0]));
  get(record.sums.data(), layout.size() * sizeof(double));
  get(record.times.data(), layout.time_size() * sizeof(double));
  for (std::size_t i = 0; i < faults; ++i) {
    std::array<std::int64_t, 5> whole;
    RunFault f;
    get(whole.data(), sizeof whole);
    get(&f.scalar_error, sizeof f.scalar_error);
    f.run = whole[0];
    f.estimator = static_cast<std::int32_t>(whole[1]);
    f.step = static_cast<std::int32_t>(whole[2]);
    f.kind = static_cast<RunFault::Kind>(whole[3]);
    f.status = static_cast<Status>(whole[4]);
    record.faults.push_back(f);
  }
  return true;
}

/// Names what differs between two identities.
inline std::string difference(const Json& theirs, const Json& ours) {
  for (const auto& [key, value] : ours.items()) {
    const std::string other = theirs.is_object() && theirs.contains(key) ? theirs[key].dump() : "nothing";
    if (other != value.dump()) return key + " is " + other + " there and " + value.dump() + " here";
  }
  return "its format is another";
}

class Journal {
 public:
  Journal() = default;
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;
  ~Journal() { close(); }

  [[nodiscard]] bool is_open() const { return file_ >= 0; }

  /// Opens or makes the file and hands every valid block to `use`. Not empty: why it cannot be used; the file
  /// is then as it was.
  std::string open(const std::string& path, const Json& identity, const TallyLayout& layout,
                   const std::function<void(BlockRecord&&)>& use) {
    path_ = path;
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (file_ < 0) return "cannot open the journal " + path + ": " + std::strerror(errno);
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0) return refuse("is in use by another process");
    struct stat about{};
    if (::fstat(file_, &about) != 0 || !S_ISREG(about.st_mode)) return refuse("is not a regular file");
    size_ = static_cast<std::uint64_t>(about.st_size);
    Bytes header(magic.begin(), magic.end());
    const std::string text = identity.dump(-1, ' ', false, Json::error_handler_t::replace);
    append_frame(header, Bytes(text.begin(), text.end()));

    Bytes start(std::min<std::uint64_t>(size_, header.size()));
    if (!read_at(0, start.data(), start.size())) return refuse("cannot be read");
    if (start.size() < header.size() && std::equal(start.begin(), start.end(), header.begin())) {
      if (!cut(0) || !append(header))
        return refuse(std::string("cannot be written: ") + std::strerror(errno));
      return {};
    }
    std::string error = take_over(text, identity, layout, use);
    if (error.empty() && !cut(end_)) return refuse(std::string("cannot be written: ") + std::strerror(errno));
    return error;
  }

  /// Hands every valid block of a journal that is left as it is to `use`. Not empty: why it cannot be used.
  static std::string read(const std::string& path, const Json& identity, const TallyLayout& layout,
                          const std::function<void(BlockRecord&&)>& use) {
    Journal journal;
    journal.path_ = path;
    journal.file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (journal.file_ < 0) return "cannot open the journal " + path + ": " + std::strerror(errno);
    if (::flock(journal.file_, LOCK_SH | LOCK_NB) != 0) return journal.refuse("is in use by another process");
    struct stat about{};
    if (::fstat(journal.file_, &about) != 0 || !S_ISREG(about.st_mode))
      return journal.refuse("is not a regular file");
    journal.size_ = static_cast<std::uint64_t>(about.st_size);
    if (journal.size_ == 0) return {};  // killed before it began
    return journal.take_over(identity.dump(-1, ' ', false, Json::error_handler_t::replace), identity, layout,
                             use);
  }

  /// Appends a block. False: it could not be written, and the journal is closed with all earlier blocks.
  bool add(const Bytes& block) {
    Bytes frame;
    frame.reserve(block.size() + 16);
    append_frame(frame, block);
    return append(frame);
  }

 private:
  /// The blocks of an open file; end_ is where the last valid one ends. Not empty: why it is none of ours,
  /// and it is closed.
  std::string take_over(const std::string& text, const Json& identity, const TallyLayout& layout,
                        const std::function<void(BlockRecord&&)>& use) {
    Bytes start(std::min<std::uint64_t>(size_, magic.size()));
    if (!read_at(0, start.data(), start.size())) return refuse("cannot be read");
    if (!std::equal(magic.begin(), magic.end(), start.begin(), start.end()))
      return refuse("is not a journal of a campaign");
    std::uint64_t at = magic.size();
    Bytes bytes;
    if (!read_frame(at, bytes)) return refuse("has a damaged header");
    if (std::string(bytes.begin(), bytes.end()) != text) {
      return refuse("belongs to another campaign: " +
                    difference(Json::parse(bytes.begin(), bytes.end(), nullptr, false), identity));
    }
    end_ = at;
    BlockRecord record;
    while (read_frame(at, bytes) && from_bytes(bytes, layout, record)) {
      end_ = at;
      use(std::move(record));
    }
    return {};
  }

  static constexpr std::array<char, 8> magic{'j', 'm', 'l', 'j', 'o', 'u', 'r', '1'};

  static std::uint64_t checksum(const Bytes& bytes) {
    boost::crc_optimal<64, 0x42F0E1EBA9EA3693, ~std::uint64_t{0}, ~std::uint64_t{0}, true, true> crc;  // XZ's
    crc.process_bytes(bytes.data(), bytes.size());
    return crc.checksum();
  }
  static void append_frame(Bytes& to, const Bytes& bytes) {
    const std::array<std::uint64_t, 2> lead{bytes.size(), checksum(bytes)};
    put(to, lead.data(), sizeof lead);
    put(to, bytes.data(), bytes.size());
  }

  /// The frame at `at`, which moves behind it.
  bool read_frame(std::uint64_t& at, Bytes& bytes) {
    std::array<std::uint64_t, 2> lead;
    if (size_ - at < sizeof lead || !read_at(at, lead.data(), sizeof lead)) return false;
    if (lead[0] > size_ - at - sizeof lead) return false;
    bytes.resize(lead[0]);
    if (!read_at(at + sizeof lead, bytes.data(), bytes.size()) || checksum(bytes) != lead[1]) return false;
    at += sizeof lead + bytes.size();
    return true;
  }
  bool read_at(std::uint64_t at, void* to, std::size_t size) {
    char* next = static_cast<char*>(to);
    while (size > 0) {
      const ssize_t got = ::pread(file_, next, size, static_cast<off_t>(at));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      next += got;
      at += static_cast<std::uint64_t>(got);
      size -= static_cast<std::size_t>(got);
    }
    return true;
  }
  bool append(const Bytes& bytes) {
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t wrote =
          ::pwrite(file_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(end_ + done));
      if (wrote < 0 && errno == EINTR) continue;
      if (wrote <= 0) {
        const int reason = errno;
        cut(end_);
        close();
        errno = reason;
        return false;
      }
      done += static_cast<std::size_t>(wrote);
    }
    end_ += bytes.size();
    return true;
  }
  bool cut(std::uint64_t size) {
    end_ = size;
    return ::ftruncate(file_, static_cast<off_t>(size)) == 0;
  }
  void close() {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
  }
  std::string refuse(const std::string& why) {
    close();
    return "the journal " + path_ + ' ' + why;
  }

  std::string path_;
  int file_ = -1;
  std::uint64_t size_ = 0, end_ = 0;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
