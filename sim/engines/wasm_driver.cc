// The driver as a WebAssembly module without imports: behind the text of `cxxrtl_driver.cc`. Memory is given out from
// one end and taken back at once, `new` included: what a run needs goes when it ends.

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

extern "C" unsigned char __heap_base;

namespace {

uintptr_t top;

void *give(size_t size) {
	const uintptr_t at = ((top ? top : uintptr_t(&__heap_base)) + 15) & ~uintptr_t(15);
	top = at + size;
	const size_t page = 1 << 16, have = __builtin_wasm_memory_size(0) * page;
	if (top > have && __builtin_wasm_memory_grow(0, (top - have + page - 1) / page) == size_t(-1)) __builtin_trap();
	return reinterpret_cast<void *>(at);
}

Job job;
uint32_t status_words[(decltype(Model::p_status)::bits + 31) / 32];
const uint8_t never = 0;

} // namespace

void *operator new(size_t size) { return give(size); }
void *operator new[](size_t size) { return give(size); }
void operator delete(void *) noexcept {}
void operator delete(void *, size_t) noexcept {}
void operator delete[](void *) noexcept {}
void operator delete[](void *, size_t) noexcept {}
extern "C" void abort() { __builtin_trap(); }
extern "C" void __cxa_pure_virtual() { __builtin_trap(); }

// Memory for the arrays of a run, until `release`.
EXPORT(reserve) void *reserve(uint32_t size) { return give(size); }
EXPORT(release) void release() { top = 0; }

// What is known after a run: cycles up to and with the last transfer, pixels given, and words of the status.
EXPORT(cycles) int32_t cycles() { return job.last + 1; }
EXPORT(given) int32_t given() { return job.given; }
EXPORT(status) const uint32_t *status() { return status_words; }

// Sets the run that follows: arrays as those of `Job`, every one reserved before; starts at power-up.
EXPORT(prepare) void prepare(const uint32_t *write, int32_t writes, const uint32_t *input, int32_t inputs, uint32_t *output,
		int32_t count, int64_t *cycles, int64_t *input_cycles) {
	job = Job{};
	job.write = write;
	job.write_count = writes;
	job.input = input;
	job.input_count = inputs;
	job.input_stalls = job.output_stalls = &never;
	job.input_period = job.output_period = 1;
	job.count = count;
	job.idle_timeout = 10000;
	job.settle = 64;
	job.last = -1;
	job.output = output;
	job.cycles = cycles;
	job.input_cycles = input_cycles;
	job.status = status_words;
}

// Runs to the end; its `End`.
EXPORT(run) int32_t run() {
	const uintptr_t before = top;
	const int32_t end = blysk_run(blysk_open(), &job, int64_t(1) << 40);
	top = before;
	return end;
}

// The same a clock at a time, with the status after each in `rows`: words as they stand on the next clock. As many
// cycles as `limit`, or to the end. The number of rows; `End` is in `ended`.
EXPORT(trace) int32_t trace(uint32_t *rows, int32_t limit, int32_t *ended) {
	const uintptr_t before = top;
	Simulation *simulation = static_cast<Simulation *>(blysk_open());
	const size_t pixel_words = count(simulation->model.p_o____payload), words = sizeof status_words / sizeof *status_words;
	int32_t row = 0;
	while (row < limit) {
		const int64_t given = job.given;
		*ended = blysk_run(simulation, &job, 1);
		job.output += (job.given - given) * pixel_words;
		job.cycles += job.given - given;
		if (*ended != LIMIT) break;
		memcpy(rows + row++ * words, status_words, sizeof status_words);
	}
	top = before;
	return row;
}
