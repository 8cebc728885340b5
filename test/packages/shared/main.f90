!> Calls what is in the shared object.
program main
    use, intrinsic :: iso_c_binding, only: c_int
    implicit none
    interface
        integer(c_int) function turn_body() bind(c)
            import :: c_int
            implicit none
        end function turn_body
    end interface

    if (turn_body() /= 0) error stop 1
end program main
