!> Drifts by name, for comparisons in the same loop: the free flow and the paper's two steps, exact or
!> semi-exact.
module frb_drifts
    use frb_flow_axes, only: turn_back
    use frb_free_flow, only: core_of, free_flow, rigid_body
    use frb_inertia, only: body_core, core_from_moments, keep_off_axis, to_principal
    use frb_kinds, only: wp, most_points
    use frb_matrix_step, only: frb_step
    use frb_quat_step, only: quat_step
    use frb_rotations, only: cross, matrix_to_quat, quat_product
    use frb_status, only: return_or_stop, status_ok, status_bad_option
    use frb_torque, only: body_drift
    implicit none
    private

    public :: flow_drift, matrix_drift, quaternion_drift, drift_by_name

    !> The free flow, as `integrate` uses it when no drift is given.
    type, extends(body_drift) :: flow_drift
    contains
        procedure :: advance => advance_by_flow    !! by `free_flow`
    end type flow_drift

    !> The paper's Algorithm 1, `frb_step`.
    type, extends(body_drift) :: matrix_drift
        integer :: points = 0       !! Gauss points; 0: exact
    contains
        procedure :: advance => advance_by_matrix    !! by `frb_step`
    end type matrix_drift

    !> The paper's Algorithm 2, `quat_step`.
    type, extends(body_drift) :: quaternion_drift
        integer :: points = 0       !! Gauss points; 0: exact
        integer :: frame = 1        !! 1, 2 or 3
    contains
        procedure :: advance => advance_by_quaternion    !! by `quat_step`
    end type quaternion_drift

contains

    !> The drift with the name `free_flow`, `frb_step` or `quat_step`; the last two may be followed by a colon
    !> and a number of Gauss points, 1 to 1000, for the semi-exact step: `quat_step:3`.
    !> Any other name: `status_bad_option`, and the free flow.
    subroutine drift_by_name(name, drift, stat)
        character(*), intent(in) :: name
        class(body_drift), allocatable, intent(out) :: drift
        integer, intent(out), optional :: stat
        integer, parameter :: most_digits = 4
        character(:), allocatable :: digits
        integer :: colon, points, code

        code = status_ok
        points = 0
        colon = index(name, ':')
        if (colon > 0) then
            digits = trim(name(colon + 1:))
            if (len(digits) < 1 .or. len(digits) > most_digits .or. verify(digits, '0123456789') > 0) then
                code = status_bad_option
            else
                read (digits, *) points
                if (points < 1 .or. points > most_points) code = status_bad_option
            end if
        else
            colon = len_trim(name) + 1
        end if
        if (code == status_ok) then
            select case (name(:colon - 1))
            case ('frb_step')
                allocate (drift, source=matrix_drift(points))
            case ('quat_step')
                allocate (drift, source=quaternion_drift(points))
            case default
                if (name /= 'free_flow') code = status_bad_option
            end select
        end if
        if (.not. allocated(drift)) allocate (flow_drift :: drift)
        call return_or_stop(code, 'drift_by_name', stat)
    end subroutine drift_by_name

    !> The exact flow.
    subroutine advance_by_flow(self, body, h, m, q, stat)
        class(flow_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat

        associate (unused => self)
        end associate
        call free_flow(body, h, m, q, stat)
    end subroutine advance_by_flow

    !> The turn of the body as a matrix, by a step from the identity; q is multiplied by its quaternion.
    subroutine advance_by_matrix(self, body, h, m, q, stat)
        class(matrix_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat
        real(wp), parameter :: identity(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                         0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
        type(body_core) :: core
        real(wp) :: turn(3, 3), old(3), n(3)

        call prepare(body, m, core, stat)
        if (stat /= status_ok) return
        old = m
        if (core%needs_rotation) old = to_principal(core, m)
        n = old
        turn = identity
        call frb_step(n, turn, h, core%moments, old, identity, self%points, stat)
        if (stat /= status_ok) return
        if (core%needs_rotation) then
            call turn_back(core, change_by(matrix_to_quat(turn), old), matrix_to_quat(turn), m, q)
        else
            m = n
            q = quat_product(q, matrix_to_quat(turn))
        end if
    end subroutine advance_by_matrix

    !> A step of m and q; if the body axes are not principal, a step from the identity gives the turn of the
    !> body.
    subroutine advance_by_quaternion(self, body, h, m, q, stat)
        class(quaternion_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat
        type(body_core) :: core
        real(wp) :: turn(4), old(3), n(3)

        call prepare(body, m, core, stat)
        if (stat /= status_ok) return
        if (core%needs_rotation) then
            old = to_principal(core, m)
            n = old
            turn = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call quat_step(n, turn, h, core%moments, old, turn, self%points, self%frame, stat)
            if (stat == status_ok) call turn_back(core, change_by(turn, old), turn, m, q)
        else
            call quat_step(m, q, h, core%moments, m, q, self%points, self%frame, stat)
        end if
    end subroutine advance_by_quaternion

    !> The constants of the body. A linear rotor moves as a sphere of its moment, which the paper's steps
    !> take; rounding errors of m along its axis are removed, more is refused.
    pure subroutine prepare(body, m, core, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(inout) :: m(3)
        type(body_core), intent(out) :: core
        integer, intent(out) :: stat

        core = core_of(body)
        stat = core%status
        if (stat /= status_ok .or. .not. core%linear) return
        call keep_off_axis(core, m, stat)
        core = core_from_moments(spread(maxval(core%moments), 1, 3))
    end subroutine prepare

    !> The change of m when the body turns by the unit quaternion r: m is constant in space. n - old would
    !> lose the digits below those of m. With nearly principal axes the rotation of m is in these digits, and
    !> |m| would drift.
    pure function change_by(r, m) result(change)
        real(wp), intent(in) :: r(4), m(3)
        real(wp) :: change(3)
        real(wp) :: c(3)

        c = 2*cross(r(2:4), m)
        change = cross(r(2:4), c) - r(1)*c
    end function change_by

end module frb_drifts
