!> The exact flow of the free rigid body, `free_flow`: momentum only, with a quaternion, with a matrix; for
!> one body and for many. One formula for every orbit: no case is special, no input of finite numbers fails.
!>
!> State: m, angular momentum in the body; q or a, attitude, body to space. Any consistent units. Both are
!> advanced in place by the time h, of any sign and size; steps that the series reach as m + increment and
!> q + increment: N short steps gather rounding like a random walk, and the norms do not drift. A longer step
!> multiplies q by a turn of norm one to rounding: where all turns are alike, an epsilon a step can add up. A
!> quaternion keeps the norm it comes with, a matrix its defect of orthogonality, to that.
!>
!> Errors (`stat`): the status of a body that could not be made; `status_bad_momentum`, `status_bad_time`,
!> `status_bad_attitude` for NaN, Inf and a quaternion of norm zero; `status_bad_count` for arrays that do not
!> match. Refused state is left as it is. Zero momentum, h = 0 and n = 0 are the identity.
!>
!> Accuracy: m and attitude within 2 units (medians within 0.5) of the inherent sensitivity, on the 325 cases
!> of data/reference and as many of another seed; largest seen 1.6. Held by the suite `free-flow`.
!> Phases have no digits left when the angle turned in one step passes 2^53; the state is then on the right
!> orbit, at an arbitrary phase.
module frb_free_flow
    use frb_flow_many, only: flow_many
    use frb_flow_one, only: flow_body, flow_one, flow_turned
    use frb_inertia, only: rigid_body
    use frb_kinds, only: wp
    use frb_status, only: conclude, status_ok, status_bad_attitude, status_bad_count
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: free_flow

    interface free_flow
        module procedure flow_momentum
        module procedure flow_quaternion
        module procedure flow_matrix
        module procedure flow_momenta
        module procedure flow_quaternions
        module procedure flow_momenta_of_bodies
        module procedure flow_quaternions_of_bodies
    end interface free_flow

contains

    !> Advances the momentum of one body: no integral of the third kind, no attitude cost.
    subroutine flow_momentum(body, h, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h               !! time, any sign
        real(wp), intent(inout) :: m(3)         !! body angular momentum
        integer, intent(out), optional :: stat
        integer :: code

        code = body%status
        if (code == status_ok) then
            if (body%turned) then
                call flow_turned(body, h, m, code)
            else
                call flow_one(body, h, m, code)
            end if
        end if
        if (present(stat)) then
            stat = code
        else if (code /= status_ok) then
            call conclude(code, 'free_flow')
        end if
    end subroutine flow_momentum

    !> Advances the momentum and the attitude quaternion of one body.
    subroutine flow_quaternion(body, h, m, q, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h               !! time, any sign
        real(wp), intent(inout) :: m(3)         !! body angular momentum
        real(wp), intent(inout) :: q(4)         !! attitude, scalar first, body to space; not zero
        integer, intent(out), optional :: stat
        integer :: code

        code = body%status
        if (code == status_ok) then
            if (body%turned) then
                call flow_turned(body, h, m, code, q)
            else
                call flow_one(body, h, m, code, q)
            end if
        end if
        if (present(stat)) then
            stat = code
        else if (code /= status_ok) then
            call conclude(code, 'free_flow')
        end if
    end subroutine flow_quaternion

    !> Advances the momentum and the attitude matrix of one body.
    subroutine flow_matrix(body, h, m, a, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h               !! time, any sign
        real(wp), intent(inout) :: m(3)         !! body angular momentum
        real(wp), intent(inout) :: a(3, 3)      !! attitude, body to space
        integer, intent(out), optional :: stat
        real(wp) :: q(4), change(3, 3)
        integer :: code

        if (all(ieee_is_finite(a))) then
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call flow_body(body, h, m, code, q)
            if (code == status_ok) then
                ! E(q) - 1 = 2 q0 hat(q) + 2 hat(q)^2, small when the step is.
                change(1, 1) = -2*(q(3)*q(3) + q(4)*q(4))
                change(2, 1) = 2*(q(2)*q(3) + q(1)*q(4))
                change(3, 1) = 2*(q(2)*q(4) - q(1)*q(3))
                change(1, 2) = 2*(q(2)*q(3) - q(1)*q(4))
                change(2, 2) = -2*(q(2)*q(2) + q(4)*q(4))
                change(3, 2) = 2*(q(3)*q(4) + q(1)*q(2))
                change(1, 3) = 2*(q(2)*q(4) + q(1)*q(3))
                change(2, 3) = 2*(q(3)*q(4) - q(1)*q(2))
                change(3, 3) = -2*(q(2)*q(2) + q(3)*q(3))
                a = a + matmul(a, change)
            end if
        else
            code = status_bad_attitude
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_matrix

    !> Advances the momenta of n equal bodies.
    subroutine flow_momenta(body, h, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :)      !! (3, n)
        integer, intent(out), optional :: stat
        integer :: code

        code = status_bad_count
        if (size(m, 1) == 3) call flow_many([body], 1, h, size(m, 2), m, code)
        call conclude(code, 'free_flow', stat)
    end subroutine flow_momenta

    !> Advances the momenta and attitudes of n equal bodies, in blocks that fill SIMD lanes (a body given by a
    !> tensor goes one by one). A body that is refused keeps its state and the
    !> others go on; `stat` then tells why (the largest code, if there are several).
    subroutine flow_quaternions(body, h, m, q, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :)      !! (3, n)
        real(wp), intent(inout), contiguous :: q(:, :)      !! (4, n)
        integer, intent(out), optional :: stat
        integer :: code

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(q, 1) == 4 .and. size(m, 2) == size(q, 2)) then
            call flow_many([body], 1, h, size(m, 2), m, code, q)
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_quaternions

    !> Advances the momenta of the n bodies body(:).
    subroutine flow_momenta_of_bodies(body, h, m, stat)
        type(rigid_body), intent(in) :: body(:)             !! (n)
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :)      !! (3, n)
        integer, intent(out), optional :: stat
        integer :: code

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(body) == size(m, 2)) then
            call flow_many(body, size(body), h, size(m, 2), m, code)
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_momenta_of_bodies

    !> Advances the momenta and attitudes of the n bodies body(:).
    subroutine flow_quaternions_of_bodies(body, h, m, q, stat)
        type(rigid_body), intent(in) :: body(:)             !! (n)
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :)      !! (3, n)
        real(wp), intent(inout), contiguous :: q(:, :)      !! (4, n)
        integer, intent(out), optional :: stat
        integer :: code

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(q, 1) == 4 .and. size(m, 2) == size(q, 2) &
            .and. size(body) == size(m, 2)) then
            call flow_many(body, size(body), h, size(m, 2), m, code, q)
        end if
        call conclude(code, 'free_flow', stat)
    end subroutine flow_quaternions_of_bodies

end module frb_free_flow
