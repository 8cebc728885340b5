!> The C interface to the derivative of the exact step, described in frb.h.
module frb_c_tangent
    use frb_c_memory, only: find_state, quadruple, triple
    use frb_free_flow, only: flow_tangent, rigid_body
    use frb_status, only: status_ok, status_bad_count
    use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_ptr
    implicit none
    private

    !> Derivatives of (m', theta') by (m, theta), in C row after row.
    integer, parameter :: columns = 6

contains

    !> The step with its derivatives by the state, and by the moments when asked for.
    function c_flow_tangent(body, h, m, q, transition, by_moments) &
        bind(c, name='frb_flow_tangent') result(stat)
        type(c_ptr), value :: body, m, q, transition, by_moments
        real(c_double), value :: h
        integer(c_int) :: stat
        type(rigid_body), pointer :: whole_body
        type(triple), pointer :: m3
        type(quadruple), pointer :: q4
        real(c_double), pointer :: rows(:, :)
        real(c_double) :: by_state(columns, columns), by_inertia(columns, 3)
        integer :: code

        call find_state(body, m, q, whole_body, m3, q4, stat)
        if (stat /= status_ok) return
        stat = status_bad_count
        if (.not. c_associated(transition)) return
        if (c_associated(by_moments)) then
            call flow_tangent(whole_body, h, m3%x, q4%x, by_state, by_inertia, code)
            call c_f_pointer(by_moments, rows, [3, columns])
            rows = transpose(by_inertia)
        else
            call flow_tangent(whole_body, h, m3%x, q4%x, by_state, code)
        end if
        call c_f_pointer(transition, rows, [columns, columns])
        rows = transpose(by_state)
        stat = int(code, c_int)
    end function c_flow_tangent

end module frb_c_tangent
