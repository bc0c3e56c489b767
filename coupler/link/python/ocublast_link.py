"""Participant library for Python: the twin of coupler/link/participant.hpp.

Needs python3-zmq, python3-protobuf, python3-numpy, python3-xxhash (Debian packages) and
coupling_pb2.py, which the build generates beside this file's copy in BUILD/python.

A solid solver in full:

    coupler = Participant("solid", "my solver 1", case_hash)
    coupler.send_mesh("skin", vertices, triangles)
    coupler.ready(stable_step)
    for order in coupler.orders():
        if order.kind == "checkpoint":
            save(order.checkpoint); coupler.checkpoint_written()
        else:
            coupler.send(position=x, velocity=v, stable_step=dt, steps_taken=n)
    coupler.goodbye()

All quantities in SI units; arrays are float64, shapes [n, 3] and [n]. Every wait has a deadline
and ends in LinkError.
"""

import os

import numpy as np
import xxhash
import zmq
from zmq.utils.monitor import recv_monitor_message

import coupling_pb2 as pb

PROTOCOL_MAJOR, PROTOCOL_MINOR = 1, 2
POSITION, VELOCITY, ACCELERATION, OVERPRESSURE, MESH, FORCE, BALANCE = 1, 2, 4, 8, 16, 32, 64


class LinkError(RuntimeError):
    """The coupler is at fault, or gone, or ended the run."""


def checksum(payload):
    """XXH3, 64 bits, of a payload; 0 for an empty one."""
    return xxhash.xxh3_64_intdigest(payload) if len(payload) else 0


class Order:
    """What the coupler asks: kind is "step" or "checkpoint"."""

    def __init__(self, header, kind):
        self.kind = kind
        self.window = header.window
        self.t_begin, self.t_end = header.t_begin_s, header.t_end_s
        self.steps = header.steps
        self.idle = header.idle
        self.iteration = header.iteration  # implicit coupling: 1, 2, ...; from 2 on begin the window again
        self.load_linear = header.load_shape != pb.LOAD_SHAPE_CONSTANT
        self.wall_cubic = header.wall_path != pb.WALL_PATH_STRAIGHT
        self.checkpoint = header.directory
        self.position = self.velocity = self.overpressure = None
        self.force = None  # [n, 3] N instead of overpressure, to a solid that takes it (see ready)


class Participant:
    """One side of a coupled run. Role: "flow" or "solid"."""

    def __init__(self, role, program, case_hash, endpoint=None, token=None, silence_limit=60.0):
        self.endpoint = endpoint or os.environ.get("OCUBLAST_ENDPOINT", "")
        if not self.endpoint:
            raise LinkError("no coupler: OCUBLAST_ENDPOINT is not set; run 'coupler CASE.toml'")
        self.role = role
        self.name = os.environ.get("OCUBLAST_NAME", "") if role == "solid" else ""  # of several solids
        self.silence_limit = float(os.environ.get("OCUBLAST_SILENCE_LIMIT_S") or silence_limit)
        self.run_id, self.sent, self.received = 0, 0, 0
        self.n_vertices = self.n_triangles = self.mesh_hash = self.window = 0
        self.n_interfaces = 1
        self.order = None
        self._connect(token or os.environ.get("OCUBLAST_TOKEN", ""))
        hello = self.header(pb.KIND_HELLO)
        hello.protocol_major, hello.protocol_minor = PROTOCOL_MAJOR, PROTOCOL_MINOR
        hello.role = pb.ROLE_FLOW if role == "flow" else pb.ROLE_SOLID
        hello.program, hello.token = program, self.token
        if self.name:
            hello.name = self.name
        hello.case_hash, hello.byte_order_mark = case_hash, 1.5
        self.send_raw(hello, b"")
        welcome, _ = self._await(pb.KIND_WELCOME)
        self.silence_limit = welcome.silence_limit_s

    def _connect(self, token):
        self.token = token
        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.DEALER)
        timeout = int(min(max(1000 * self.silence_limit, 50), 5000))
        for option, value in ((zmq.LINGER, 0), (zmq.SNDHWM, 4), (zmq.RCVHWM, 4), (zmq.IMMEDIATE, 1),
                              (zmq.RECONNECT_IVL, -1), (zmq.HEARTBEAT_IVL, max(timeout // 5, 10)),
                              (zmq.HEARTBEAT_TIMEOUT, timeout), (zmq.HEARTBEAT_TTL, max(timeout, 100)),
                              (zmq.SNDTIMEO, int(1000 * self.silence_limit))):
            self.socket.setsockopt(option, value)
        keys = os.environ.get("OCUBLAST_KEYS", "")
        if keys:
            with open(os.path.join(keys, (self.name or self.role) + ".key"), encoding="ascii") as file:
                server, public, secret, self.token = file.read().split()
            self.socket.curve_serverkey = server.encode()
            self.socket.curve_publickey = public.encode()
            self.socket.curve_secretkey = secret.encode()
        self.monitor = self.socket.get_monitor_socket(zmq.EVENT_DISCONNECTED)
        self.socket.connect(self.endpoint)

    # --- frames ---------------------------------------------------------------------------------

    def header(self, kind):
        """A header with what every message carries."""
        h = pb.Header()
        h.kind, h.run_id, h.seq, h.window = kind, self.run_id, self.sent + 1, self.window
        h.fields = 0
        return h

    def send_raw(self, header, payload):
        """Sends a header, its length and checksum filled in, and a payload of bytes."""
        header.payload_bytes, header.payload_checksum = len(payload), checksum(payload)
        try:
            self.socket.send_multipart([header.SerializeToString(), payload])
        except zmq.Again:
            raise LinkError(f"the coupler takes no message for {self.silence_limit} s") from None
        self.sent += 1

    def _receive(self, what):
        poller = zmq.Poller()
        poller.register(self.socket, zmq.POLLIN)
        poller.register(self.monitor, zmq.POLLIN)
        ready = dict(poller.poll(1000 * self.silence_limit))
        if self.socket in ready:
            return self.socket.recv_multipart()
        if self.monitor in ready:
            recv_monitor_message(self.monitor)
            if self.socket.poll(500):  # what it said before it went counts
                return self.socket.recv_multipart()
            raise LinkError(f"the coupler is gone while awaiting {what}")
        raise LinkError(f"no word from the coupler for {self.silence_limit} s while awaiting {what}")

    def _await(self, *kinds):
        what = " or ".join(pb.Kind.Name(k)[5:] for k in kinds)
        while True:
            frames = self._receive(what)
            if len(frames) != 2:
                raise LinkError("a message that has not two frames")
            header = pb.Header()
            header.ParseFromString(frames[0])
            self.run_id = self.run_id or header.run_id
            if header.run_id != self.run_id or header.seq != self.received + 1:
                raise LinkError("a message of another run, or out of order")
            self.received += 1
            if header.kind == pb.KIND_ABORT:
                raise LinkError(f"the coupler ended the run: {header.reason}")
            if header.kind == pb.KIND_WAIT:
                continue
            if header.kind not in kinds:
                raise LinkError(f"{pb.Kind.Name(header.kind)} came while awaiting {what}")
            if len(frames[1]) != header.payload_bytes or checksum(frames[1]) != header.payload_checksum:
                raise LinkError(f"the payload of {pb.Kind.Name(header.kind)} is damaged")
            return header, frames[1]

    # --- the run --------------------------------------------------------------------------------

    def send_mesh(self, name, vertices, triangles):
        """Solid: closed wet surface, vertices [n, 3] m, triangles [m, 3] oriented outward. Flow, after
        receive_mesh: a mesh of its own for it; the coupler maps."""
        points = np.ascontiguousarray(vertices, dtype="<f8")
        corners = np.ascontiguousarray(triangles, dtype="<i4")
        payload = points.tobytes() + corners.tobytes()
        self.n_vertices, self.n_triangles = len(points), len(corners)
        self.mesh_hash = checksum(payload)
        h = self.header(pb.KIND_MESH)
        h.fields, h.n_vertices, h.n_triangles = MESH, self.n_vertices, self.n_triangles
        h.mesh_hash, h.mesh_name = self.mesh_hash, name
        self.send_raw(h, payload)

    def receive_mesh(self):
        """Flow with one solid: name, vertices [n, 3], triangles [m, 3]."""
        meshes = self.receive_meshes()
        if len(meshes) != 1:
            raise LinkError(f"{len(meshes)} solids take part: call receive_meshes")
        return meshes[0]

    def receive_meshes(self):
        """Flow: name, vertices [n, 3], triangles [m, 3] of every solid. Orders and results then hold the values of
        all, one solid after the other."""
        meshes, hashes = [], []
        self.n_vertices = self.n_triangles = 0
        while True:
            h, payload = self._await(pb.KIND_MESH)
            split = 24 * h.n_vertices
            meshes.append((h.mesh_name, np.frombuffer(payload[:split], "<f8").reshape(-1, 3),
                           np.frombuffer(payload[split:], "<i4").reshape(-1, 3)))
            hashes.append(checksum(payload))
            self.n_vertices += h.n_vertices
            self.n_triangles += h.n_triangles
            if len(meshes) >= (h.n_interfaces or 1):
                break
        self.n_interfaces = len(meshes)
        self.mesh_hash = hashes[0] if len(hashes) == 1 else checksum(np.array(hashes, "<u8").tobytes())
        return meshes

    def ready(self, stable_step, window=0, time_s=0.0, velocity=None, takes_force=False):
        """Set-up is done; where it stands (0, 0.0 when fresh); initial velocity [n, 3] if any. A solid
        that takes forces may be given order.force instead of overpressure."""
        self.window = window
        h = self.header(pb.KIND_READY)
        h.stable_step_s, h.time_s, h.mesh_hash = stable_step, time_s, self.mesh_hash
        h.takes_force = takes_force
        payload = b""
        if velocity is not None:
            h.fields, h.n_vertices = VELOCITY, self.n_vertices
            payload = np.ascontiguousarray(velocity, dtype="<f8").tobytes()
        self.send_raw(h, payload)

    def orders(self):
        """Yields orders until the coupler says FINISH."""
        while True:
            h, payload = self._await(pb.KIND_STEP, pb.KIND_CHECKPOINT, pb.KIND_FINISH)
            if h.kind == pb.KIND_FINISH:
                return
            self.order = Order(h, "step" if h.kind == pb.KIND_STEP else "checkpoint")
            values = np.frombuffer(payload, "<f8")
            if h.fields == OVERPRESSURE:
                self.order.overpressure = values
            elif h.fields == FORCE:
                self.order.force = values.reshape(-1, 3)
            elif h.fields == POSITION | VELOCITY:
                self.order.position, self.order.velocity = values.reshape(2, -1, 3)
            yield self.order

    def result(self, stable_step, steps_taken, idle=False, work=0.0, impulse=(0.0, 0.0, 0.0),
               impedance=0.0, mass_per_area=0.0, compute_seconds=0.0, status=""):
        """The header of a RESULT for the last step order, without fields."""
        self.window = self.order.window
        h = self.header(pb.KIND_RESULT)
        h.t_begin_s, h.t_end_s, h.steps, h.idle = self.order.t_begin, self.order.t_end, steps_taken, idle
        if self.order.iteration:
            h.iteration = self.order.iteration
        h.stable_step_s, h.work_J = stable_step, work
        h.impulse_x_N_s, h.impulse_y_N_s, h.impulse_z_N_s = impulse
        h.impedance_kg_m2_s, h.mass_per_area_kg_m2 = impedance, mass_per_area
        h.compute_s, h.status, h.n_vertices = compute_seconds, status[:200], self.n_vertices
        return h

    def send(self, position=None, velocity=None, overpressure=None, balance=None, **report):
        """Answers a step order. Solid: position and velocity [n, 3]; flow: overpressure [n], and with several solids
        balance [n_interfaces, 4] if it knows it: work J and impulse N s given to each; nothing with idle=True."""
        h = self.result(**report)
        parts = []
        if balance is not None:
            h.n_interfaces = self.n_interfaces
        for values, bit in ((position, POSITION), (velocity, VELOCITY), (overpressure, OVERPRESSURE), (balance, BALANCE)):
            if values is not None:
                h.fields |= bit
                parts.append(np.ascontiguousarray(values, dtype="<f8").tobytes())
        self.send_raw(h, b"".join(parts))

    def checkpoint_written(self):
        """Answers a checkpoint order."""
        self.send_raw(self.header(pb.KIND_DONE), b"")

    def goodbye(self):
        """After the last order: results are written, this side ends."""
        self.send_raw(self.header(pb.KIND_BYE), b"")
        self.close(1000)

    def abort(self, reason, exit_code=1):
        """Tells the coupler why this side gives up."""
        h = self.header(pb.KIND_ABORT)
        h.reason, h.exit_code = reason[:4000], exit_code
        self.send_raw(h, b"")
        self.close(1000)

    def close(self, linger=0):
        """Ends the connection."""
        self.socket.disable_monitor()
        self.monitor.close(0)
        self.socket.close(linger)
        self.context.term()
