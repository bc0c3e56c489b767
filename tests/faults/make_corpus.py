"""First inputs for coupler_fuzz: one message of each kind, and a short recording. make_corpus.py BUILD TRAFFIC"""

import os
import struct
import sys

sys.path.insert(0, os.path.join(sys.argv[1], "python"))

import xxhash

import coupling_pb2 as pb

CORPUS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "corpus")


def put(name, header, payload=b""):
    header.payload_bytes = len(payload)
    header.payload_checksum = xxhash.xxh3_64_intdigest(payload) if payload else 0
    frame = header.SerializeToString()
    with open(os.path.join(CORPUS, name), "wb") as file:
        file.write(struct.pack("<H", len(frame)) + frame + payload)


def main():
    for kind in pb.Kind.values()[1:]:
        h = pb.Header()
        h.kind, h.run_id, h.seq, h.window, h.fields = kind, 1, 1, 1, 0
        h.protocol_major, h.protocol_minor, h.role, h.program, h.token = 1, 1, pb.ROLE_SOLID, "p", "t"
        h.case_hash, h.byte_order_mark, h.silence_limit_s, h.mesh_hash, h.mesh_name = 1, 1.5, 60.0, 1, "m"
        h.t_begin_s, h.t_end_s, h.steps, h.idle = 0.0, 1.0, 1, False
        h.load_shape, h.wall_path, h.stable_step_s, h.work_J = pb.LOAD_SHAPE_LINEAR, pb.WALL_PATH_CUBIC, 1.0, 0.0
        h.impulse_x_N_s = h.impulse_y_N_s = h.impulse_z_N_s = 0.0
        h.impedance_kg_m2_s, h.mass_per_area_kg_m2, h.compute_s, h.time_s = 1.0, 1.0, 0.0, 0.0
        h.directory, h.reason, h.exit_code, h.iteration = "d", "r", 3, 2
        h.shares_memory, h.takes_packets, h.takes_force, h.n_interfaces = True, True, True, 1
        if kind in (pb.KIND_HELLO, pb.KIND_WELCOME):
            h.packet_path, h.packet_mark = "/tmp/p", 1
            h.memory_pid, h.memory_fd, h.memory_offset, h.memory_mark = 2, 3, 0, 1
        payload = b""
        if kind == pb.KIND_MESH:  # a quadrilateral, cut along its diagonal, and a triangle
            h.fields, h.n_vertices, h.n_triangles, h.n_quads = 16, 5, 3, 1
            payload = struct.pack("<15d9i", *range(15), 0, 1, 2, 0, 2, 3, 1, 4, 2)
        if kind in (pb.KIND_STEP, pb.KIND_RESULT, pb.KIND_READY):
            h.fields, h.n_vertices = 3, 1
            payload = struct.pack("<6d", *range(6))
        put(pb.Kind.Name(kind)[5:].lower(), h, payload)
        if kind == pb.KIND_RESULT:  # forces, and the balance of two interfaces
            h.fields, h.n_vertices, h.n_interfaces = 96, 2, 2
            put("force", h, struct.pack("<14d", *range(14)))
    with open(sys.argv[2], "rb") as file:
        recording = file.read()
    with open(os.path.join(CORPUS, "recording"), "wb") as file:
        file.write(recording)


if __name__ == "__main__":
    main()
