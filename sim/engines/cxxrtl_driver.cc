// This driver runs a stream through a CXXRTL model. `sim/engines/cxxrtl.py` puts macros in front of this text: the file
// name of the model (BLYSK_MODEL), its key (BLYSK_KEY), and the optional members (BLYSK_HAS_...).
//
// One evaluation a clock is enough and exact. `eval()` computes every combinational output from the inputs and from the
// present values of the registers. It stores the next values of the registers, and `commit()` makes them the present
// values. The driver reads the outputs after `eval()` and before `commit()`. So the outputs are those just before the
// rising edge, for the inputs of this clock. This holds for a `ready` that depends on the other side's `ready`, too.
// All this needs a model whose values settle in one `eval()`. For other designs Yosys warns, and the builder refuses
// them.
//
// The model is on the heap, because g++ 12 -O2 compiles a local model wrongly.

#ifndef BLYSK_WORDS
#include <cxxrtl/cxxrtl.h>
#else
// The part of CXXRTL that a model of words needs. CXXRTL's own headers would take half a second to compile.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#define CXXRTL_ALWAYS_INLINE inline __attribute__((__always_inline__))
#define CXXRTL_ASSERT(condition) ((void)(condition))

namespace cxxrtl {

struct interior {};
struct observer {};
struct performer {};

struct module {
	module() = default;
	virtual ~module() = default;
	module(const module &) = delete;
	virtual void reset() = 0;
	virtual bool eval(performer *performer = nullptr) = 0;
	virtual bool commit() = 0;
};

} // namespace cxxrtl
#endif

// CXXRTL's own values are arrays of 32-bit chunks. They compile slowly, and the compiled code is slow. The values of
// this namespace are arrays of machine words. Most values of a datapath are one word. The shading pipeline is 2.5 times
// as fast with them. They have the operations that generated code uses. Rare operations, and operations on wide values,
// are CXXRTL's.
namespace native {

using cxxrtl::interior;
using cxxrtl::module;
using cxxrtl::observer;
using cxxrtl::performer;

using word = uint64_t;

constexpr word ones(size_t count) { return count < 64 ? (word(1) << count) - 1 : ~word(0); }

template<size_t Bits> struct value;
template<size_t Bits, size_t Stop, size_t Start> struct slice_of;

// Two parts of a value, the most significant part first. A part that may be assigned to is a reference.
template<class High, class Low> struct concat_of;

template<class Self>
struct expression {
	template<class Other>
	CXXRTL_ALWAYS_INLINE concat_of<const Self &, Other> concat(Other &&other) const & {
		return {static_cast<const Self &>(*this), std::forward<Other>(other)};
	}

	template<class Other>
	CXXRTL_ALWAYS_INLINE concat_of<Self &, Other> concat(Other &&other) & {
		return {static_cast<Self &>(*this), std::forward<Other>(other)};
	}

	template<class Other>
	CXXRTL_ALWAYS_INLINE concat_of<Self, Other> concat(Other &&other) && {
		return {static_cast<Self &&>(*this), std::forward<Other>(other)};
	}

	template<size_t Count>
	CXXRTL_ALWAYS_INLINE value<Count> repeat() const {
		static_assert(Self::bits == 1, "repeat() takes a single bit");
		const value<Count> zero;
		return static_cast<const Self &>(*this).val() ? zero.bit_not() : zero;
	}
};

template<size_t Bits>
struct value : expression<value<Bits>> {
	static constexpr size_t bits = Bits;
	static constexpr size_t words = Bits > 64 ? (Bits + 63) / 64 : 1;
	static constexpr word top = Bits ? ones((Bits - 1) % 64 + 1) : 0;

	word data[words] = {};

	value() = default;

	// A value from the chunks of 32 bits in generated code, the lowest chunk first.
	template<typename... Init>
	explicit constexpr value(uint32_t first, Init... init) {
		const uint32_t chunks[] = {first, uint32_t(init)...};
		for (size_t n = 0; n <= sizeof...(init); n++) data[n / 2] |= word(chunks[n]) << n % 2 * 32;
	}

#ifndef BLYSK_WORDS
	CXXRTL_ALWAYS_INLINE value(const cxxrtl::value<Bits> &from) {
		for (size_t n = 0; n < from.chunks; n++) data[n / 2] |= word(from.data[n]) << n % 2 * 32;
	}

	CXXRTL_ALWAYS_INLINE operator cxxrtl::value<Bits>() const {
		cxxrtl::value<Bits> result;
		for (size_t n = 0; n < result.chunks; n++) result.data[n] = data[n / 2] >> n % 2 * 32;
		return result;
	}

	CXXRTL_ALWAYS_INLINE cxxrtl::value<Bits> library() const { return *this; }
#endif

	CXXRTL_ALWAYS_INLINE static value cut(word from) {
		static_assert(words == 1, "one word");
		value result;
		result.data[0] = from & top;
		return result;
	}

	CXXRTL_ALWAYS_INLINE const value &val() const { return *this; }

	template<class Integer>
	void set(Integer from) { data[0] = from; }

	CXXRTL_ALWAYS_INLINE word sign_extended() const { return word(int64_t(data[0] << (64 - Bits)) >> (64 - Bits)); }

	CXXRTL_ALWAYS_INLINE explicit operator bool() const {
		word any = data[0];
		for (size_t n = 1; n < words; n++) any |= data[n];
		return any;
	}

	CXXRTL_ALWAYS_INLINE bool operator==(const value &other) const {
		word difference = data[0] ^ other.data[0];
		for (size_t n = 1; n < words; n++) difference |= data[n] ^ other.data[n];
		return !difference;
	}

	CXXRTL_ALWAYS_INLINE bool operator!=(const value &other) const { return !(*this == other); }

	CXXRTL_ALWAYS_INLINE value bit_not() const {
		value result;
		for (size_t n = 0; n < words; n++) result.data[n] = ~data[n];
		result.data[words - 1] &= top;
		return result;
	}

	template<size_t Stop, size_t Start>
	CXXRTL_ALWAYS_INLINE value<Stop - Start + 1> extract() const {
		static_assert(Start <= Stop && Stop < Bits, "within the value");
		value<Stop - Start + 1> result;
		for (size_t n = 0; n < result.words; n++) {
			const size_t from = Start / 64 + n;
			result.data[n] = data[from] >> Start % 64;
			if (Start % 64 && from + 1 < words && from * 64 + 63 < Stop) result.data[n] |= data[from + 1] << (64 - Start % 64);
		}
		result.data[result.words - 1] &= result.top;
		return result;
	}

	template<size_t Stop, size_t Start>
	CXXRTL_ALWAYS_INLINE void insert(const value<Stop - Start + 1> &from) {
		static_assert(Start <= Stop && Stop < Bits, "within the value");
		for (size_t n = Start / 64; n <= Stop / 64; n++) {
			const size_t first = n == Start / 64 ? Start % 64 : 0, last = n == Stop / 64 ? Stop % 64 : 63;
			const size_t at = n * 64 + first - Start;
			word part = from.data[at / 64] >> at % 64;
			if (at % 64 && at / 64 + 1 < from.words) part |= from.data[at / 64 + 1] << (64 - at % 64);
			const word mask = ones(last - first + 1) << first;
			data[n] = (data[n] & ~mask) | (part << first & mask);
		}
	}

	template<size_t Stop, size_t Start = Stop>
	CXXRTL_ALWAYS_INLINE value<Stop - Start + 1> slice() const & { return extract<Stop, Start>(); }

	template<size_t Stop, size_t Start = Stop>
	CXXRTL_ALWAYS_INLINE value<Stop - Start + 1> slice() const && { return extract<Stop, Start>(); }

	template<size_t Stop, size_t Start = Stop>
	CXXRTL_ALWAYS_INLINE slice_of<Bits, Stop, Start> slice() & { return {*this}; }
};

template<size_t Bits, size_t Stop, size_t Start>
struct slice_of : expression<slice_of<Bits, Stop, Start>> {
	static constexpr size_t bits = Stop - Start + 1;
	value<Bits> &whole;

	CXXRTL_ALWAYS_INLINE slice_of(value<Bits> &whole) : whole(whole) {}
	CXXRTL_ALWAYS_INLINE value<bits> val() const { return whole.template extract<Stop, Start>(); }
	CXXRTL_ALWAYS_INLINE void operator=(const value<bits> &from) { whole.template insert<Stop, Start>(from); }
};

template<class High, class Low>
struct concat_of : expression<concat_of<High, Low>> {
	static constexpr size_t high_bits = std::remove_reference<High>::type::bits;
	static constexpr size_t low_bits = std::remove_reference<Low>::type::bits;
	static constexpr size_t bits = high_bits + low_bits;
	High high;
	Low low;

	CXXRTL_ALWAYS_INLINE concat_of(High &&high, Low &&low) : high(static_cast<High &&>(high)), low(static_cast<Low &&>(low)) {}

	CXXRTL_ALWAYS_INLINE value<bits> val() const {
		value<bits> result;
		if constexpr (bits <= 64 && low_bits < 64) {
			result.data[0] = high.val().data[0] << low_bits | low.val().data[0];
		} else {
			if constexpr (high_bits != 0) result.template insert<bits - 1, low_bits>(high.val());
			if constexpr (low_bits != 0) result.template insert<low_bits - 1, 0>(low.val());
		}
		return result;
	}

	CXXRTL_ALWAYS_INLINE void operator=(const value<bits> &from) {
		if constexpr (high_bits != 0) high = from.template extract<bits - 1, low_bits>();
		if constexpr (low_bits != 0) low = from.template extract<low_bits - 1, 0>();
	}
};

template<size_t Bits>
struct wire {
	static constexpr size_t bits = Bits;
	value<Bits> curr, next;

	wire() = default;
	template<typename... Init>
	explicit constexpr wire(Init... init) : curr{init...}, next{init...} {}
	wire(const wire &) = delete;
	wire &operator=(wire &&) = default;

	// The result tells whether a value changed. It matters only if a clock needs several evaluations, so it is false.
	template<class Observer>
	CXXRTL_ALWAYS_INLINE bool commit(Observer &) {
		curr = next;
		return false;
	}
};

template<size_t Width>
struct memory {
	struct later {
		size_t index;
		value<Width> data, mask;
		int priority;
	};

	std::vector<value<Width>> data;
	std::vector<later> writes;

	explicit memory(size_t depth) : data(depth) {}
	memory &operator=(memory &&) = default;

	const value<Width> &operator[](size_t index) const { return data[index]; }

	// Writes at once. Nothing reads the memory after this write and before the next clock.
	CXXRTL_ALWAYS_INLINE void write(size_t index, const value<Width> &from) { data[index] = from; }

	CXXRTL_ALWAYS_INLINE void write(size_t index, const value<Width> &from, const value<Width> &mask) {
		value<Width> &target = data[index];
		for (size_t n = 0; n < value<Width>::words; n++)
			target.data[n] = (target.data[n] & ~mask.data[n]) | (from.data[n] & mask.data[n]);
	}

	// The writes of a clock happen at its edge. Writes of higher priority happen later.
	CXXRTL_ALWAYS_INLINE void update(size_t index, const value<Width> &from, const value<Width> &mask, int priority) {
		if (mask) {
			auto place = writes.end();
			while (place != writes.begin() && place[-1].priority > priority) place--;
			writes.insert(place, {index, from, mask, priority});
		}
	}

	template<class Observer>
	CXXRTL_ALWAYS_INLINE bool commit(Observer &) {
		if (!writes.empty()) {
			for (const later &each : writes)
				for (size_t n = 0; n < value<Width>::words; n++) {
					word &target = data[each.index].data[n];
					target = (target & ~each.mask.data[n]) | (each.data.data[n] & each.mask.data[n]);
				}
			writes.clear();
		}
		return false;
	}
};

struct memory_index {
	bool valid;
	size_t index;

	template<size_t Bits>
	CXXRTL_ALWAYS_INLINE memory_index(const value<Bits> &address, size_t offset, size_t depth) :
		valid((offset == 0 && Bits < 64 && depth >> Bits) || address.data[0] - offset < depth), index(address.data[0] - offset) {}
};

// Functions for the shifts and counts in the code that `words.py` writes.
CXXRTL_ALWAYS_INLINE word shifted_left(word a, word b) { return b < 64 ? a << b : 0; }
CXXRTL_ALWAYS_INLINE word shifted_right(word a, word b) { return b < 64 ? a >> b : 0; }
CXXRTL_ALWAYS_INLINE word shifted_signed(word a, word b) { return int64_t(a) >> (b < 63 ? b : 63); }
CXXRTL_ALWAYS_INLINE word leading_zeros(word a, word width) { return a ? __builtin_clzll(a) + width - 64 : width; }

#ifndef BLYSK_WORDS
#define UNARY(name, condition, result) \
	template<size_t BitsY, size_t BitsA> \
	CXXRTL_ALWAYS_INLINE value<BitsY> name(const value<BitsA> &a) { \
		if constexpr (BitsY && BitsA && (condition)) \
			return value<BitsY>::cut(result); \
		else \
			return cxxrtl_yosys::name<BitsY>(a.library()); \
	}
#define BINARY(name, condition, result) \
	template<size_t BitsY, size_t BitsA, size_t BitsB> \
	CXXRTL_ALWAYS_INLINE value<BitsY> name(const value<BitsA> &a, const value<BitsB> &b) { \
		if constexpr (BitsY && BitsA && BitsB && (condition)) \
			return value<BitsY>::cut(result); \
		else \
			return cxxrtl_yosys::name<BitsY>(a.library(), b.library()); \
	}
#define WORDS_A (BitsY <= 64 && BitsA <= 64)
#define WORDS (BitsY <= 64 && BitsA <= 64 && BitsB <= 64)
#define UNSIGNED(operation) a.data[0] operation b.data[0]
#define SIGNED(operation) a.sign_extended() operation b.sign_extended()
#define ORDER(operation) int64_t(a.sign_extended()) operation int64_t(b.sign_extended())
#define BOTH(name, operation) \
	BINARY(name##_uu, WORDS, UNSIGNED(operation)) \
	BINARY(name##_ss, WORDS, SIGNED(operation))
#define COMPARISON(name, operation) \
	BINARY(name##_uu, WORDS, UNSIGNED(operation)) \
	BINARY(name##_ss, WORDS, ORDER(operation))
#define LIBRARY(name) BINARY(name##_uu, false, 0) BINARY(name##_ss, false, 0)

UNARY(logic_not, BitsY <= 64, !a)
BINARY(logic_and, BitsY <= 64, bool(a) && bool(b))
BINARY(logic_or, BitsY <= 64, bool(a) || bool(b))
UNARY(reduce_and, BitsY <= 64, !a.bit_not())
UNARY(reduce_or, BitsY <= 64, bool(a))
UNARY(reduce_bool, BitsY <= 64, bool(a))
UNARY(reduce_xor, false, 0)
UNARY(reduce_xnor, false, 0)
UNARY(not_u, WORDS_A, ~a.data[0])
UNARY(not_s, WORDS_A, ~a.sign_extended())
UNARY(pos_u, WORDS_A, a.data[0])
UNARY(pos_s, WORDS_A, a.sign_extended())
UNARY(neg_u, WORDS_A, -a.data[0])
UNARY(neg_s, WORDS_A, -a.sign_extended())
BOTH(and, &)
BOTH(or, |)
BOTH(xor, ^)
BINARY(xnor_uu, WORDS, ~(UNSIGNED(^)))
BINARY(xnor_ss, WORDS, ~(SIGNED(^)))
BOTH(add, +)
BOTH(sub, -)
BOTH(mul, *)
BOTH(eq, ==)
BOTH(ne, !=)
BOTH(eqx, ==)
BOTH(nex, !=)
COMPARISON(lt, <)
COMPARISON(le, <=)
COMPARISON(gt, >)
COMPARISON(ge, >=)
BINARY(shl_uu, WORDS, b.data[0] < 64 ? a.data[0] << b.data[0] : 0)
BINARY(shl_su, WORDS, b.data[0] < 64 ? a.sign_extended() << b.data[0] : 0)
BINARY(sshl_uu, WORDS, b.data[0] < 64 ? a.data[0] << b.data[0] : 0)
BINARY(sshl_su, WORDS, b.data[0] < 64 ? a.sign_extended() << b.data[0] : 0)
BINARY(shr_uu, WORDS, b.data[0] < 64 ? a.data[0] >> b.data[0] : 0)
BINARY(sshr_uu, WORDS, b.data[0] < 64 ? a.data[0] >> b.data[0] : 0)
BINARY(sshr_su, WORDS, int64_t(a.sign_extended()) >> (b.data[0] < 63 ? b.data[0] : 63))
BINARY(shr_su, false, 0)
LIBRARY(shift)
BINARY(shift_su, false, 0)
BINARY(shift_us, false, 0)
LIBRARY(shiftx)
BINARY(shiftx_su, false, 0)
BINARY(shiftx_us, false, 0)
LIBRARY(div)
LIBRARY(mod)
LIBRARY(divfloor)
LIBRARY(modfloor)
#endif

} // namespace native

#define cxxrtl_yosys native
#include BLYSK_MODEL

#ifdef BLYSK_FREESTANDING
// Functions that a build without a C++ runtime library lacks.
#include <cstdlib>
void *operator new(std::size_t size) {
	if (void *memory = std::malloc(size ? size : 1)) return memory;
	std::abort();
}
void *operator new[](std::size_t size) { return operator new(size); }
void operator delete(void *memory) noexcept { std::free(memory); }
void operator delete(void *memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void *memory) noexcept { std::free(memory); }
void operator delete[](void *memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace {

template<size_t Bits>
const native::value<Bits> &current(const native::value<Bits> &port) { return port; }

template<size_t Bits>
const native::value<Bits> &current(const native::wire<Bits> &port) { return port.curr; }

template<class Port>
bool high(const Port &port) { return current(port).data[0]; }

// Number of 32-bit words into which the payload of a port is packed.
template<class Port>
constexpr size_t count(const Port &) { return (Port::bits + 31) / 32; }

template<size_t Bits>
void load(native::value<Bits> &port, const uint32_t *from) { memcpy(port.data, from, count(port) * 4); }

template<class Port>
void store(uint32_t *to, const Port &port) { memcpy(to, current(port).data, count(port) * 4); }

template<class Port>
bool equal(const uint32_t *to, const Port &port) { return !memcmp(to, current(port).data, count(port) * 4); }

template<size_t Bits>
void fill(native::value<Bits> &port) { port = native::value<Bits>{}.bit_not(); }

// The numbers of `engine.StopReason`.
enum End : int32_t { LIMIT, DONE, DROPPED, CHANGED, EXTRA, STUCK };

using Model = cxxrtl_design::p_top;

struct Simulation {
	Model model;
	uint32_t held[sizeof(Model::p_o____payload) / sizeof(uint32_t)] = {};
	bool offered = false, waiting = false;
};

} // namespace

// `cxxrtl._Job` has the same members.
struct Job {
	const uint32_t *constants, *write, *input;
	const uint8_t *input_stalls, *output_stalls;
	const int64_t *write_after; // Number of input beats taken before each write. Null stands for 0.
	int64_t write_count, input_count, input_period, output_period;
	int64_t count; // Expected number of output beats. -1 stands for any number.
	int64_t idle_timeout, settle;
	// State of the run.
	int64_t clock, last, written, taken, given;
	// `output` and `cycles` hold one batch. `input_cycles` holds the whole run.
	uint32_t *output;
	int64_t *cycles, *input_cycles;
	uint32_t *status;
};

extern "C" {

const char *blysk_key() { return BLYSK_KEY; }

void *blysk_open() {
	Simulation *simulation = new Simulation;
	Model &model = simulation->model;
	model.p_clk.set(true);
	fill(model.p_i____payload);
#ifdef BLYSK_HAS_WRITE
	fill(model.p_write____payload);
#endif
	return simulation;
}

void blysk_close(void *handle) { delete static_cast<Simulation *>(handle); }

int32_t blysk_run(void *handle, Job *job, int64_t cycles) {
	Simulation &simulation = *static_cast<Simulation *>(handle);
	Model &model = simulation.model;
	bool offered = simulation.offered, waiting = simulation.waiting;
	int64_t clock = job->clock, last = job->last, written = job->written, taken = job->taken, given = job->given;
	const int64_t limit = clock + cycles, given_before = given;
	int64_t input_phase = clock % job->input_period, output_phase = clock % job->output_period;
	uint32_t *output = job->output;
	End end = LIMIT;
#ifdef BLYSK_HAS_CONSTANTS
	load(model.p_constants, job->constants);
#endif

	for (; clock != limit; clock++) {
		if (given == job->count && taken == job->input_count && written == job->write_count &&
				clock - last > job->settle) {
			end = DONE;
			break;
		}
		if (clock - last > job->idle_timeout) {
			end = job->count < 0 && taken == job->input_count ? DONE : STUCK;
			break;
		}

		const int64_t after = job->write_after && written < job->write_count ? job->write_after[written] : 0;
		const bool writing = written < job->write_count && taken >= after;
		if (writing) {
#ifdef BLYSK_HAS_WRITE
			model.p_write____valid.set(true);
			load(model.p_write____payload, job->write + written * count(model.p_write____payload));
#endif
		}
		if (!offered && !(writing && after == 0) && taken < job->input_count && !job->input_stalls[input_phase]) {
			offered = true;
			model.p_i____valid.set(true);
			load(model.p_i____payload, job->input + taken * count(model.p_i____payload));
		}
		const bool ready = !job->output_stalls[output_phase];
		model.p_o____ready.set(ready);
		if (++input_phase == job->input_period) input_phase = 0;
		if (++output_phase == job->output_period) output_phase = 0;

		model.prev_p_clk.set(false);
		model.eval();

		const bool valid = high(model.p_o____valid);
		if (waiting) {
			if (!valid) {
				end = DROPPED;
				break;
			}
			if (!equal(simulation.held, model.p_o____payload)) {
				end = CHANGED;
				break;
			}
		}
		if (valid && given == job->count) {
			end = EXTRA;
			break;
		}
		waiting = valid && !ready;
		if (waiting) store(simulation.held, model.p_o____payload);
		bool moved = false;
		if (valid && ready) {
			store(output, model.p_o____payload);
			output += count(model.p_o____payload);
			job->cycles[given - given_before] = clock;
			given++;
			moved = true;
		}
		const bool input_moves = offered && high(model.p_i____ready);
#ifdef BLYSK_HAS_WRITE
		const bool write_moves = writing && high(model.p_write____ready);
#endif

		model.commit();

#ifdef BLYSK_HAS_WRITE
		if (write_moves) {
			moved = true;
			written++;
			model.p_write____valid.set(false);
			fill(model.p_write____payload);
		}
#endif
		if (input_moves) {
			job->input_cycles[taken] = clock;
			taken++;
			offered = false;
			moved = true;
			model.p_i____valid.set(false);
			// If there is a next beat to offer, it replaces these 1 bits.
			fill(model.p_i____payload);
		}
		if (moved) last = clock;
	}

#ifdef BLYSK_HAS_STATUS
	if (end == DONE || end == LIMIT) {
		// This evaluation has no clock edge, so it computes combinational outputs only. In a model
		// that `parts.py` has rewritten, only an evaluation without an edge computes the status.
		model.prev_p_clk.set(true);
		model.eval();
		store(job->status, model.p_status);
	}
#endif
	simulation.offered = offered;
	simulation.waiting = waiting;
	job->clock = clock;
	job->last = last;
	job->written = written;
	job->taken = taken;
	job->given = given;
	return end;
}

} // extern "C"
